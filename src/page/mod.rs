//! Self-contained HTML pages: style, data and scripts in one file.

use serde_json::Value;

/// Parts of a page.
#[derive(Debug)]
pub struct Page<'a> {
    /// Title of the window.
    pub title: &'a str,
    /// CSS.
    pub style: &'a str,
    /// JSON for the scripts, read by `document.getElementById("data")`.
    pub data: &'a Value,
    /// JavaScript files in order, joined in one scope.
    pub scripts: &'a [&'a str],
}

/// The HTML file. Its content policy forbids all requests, so that opening a mailed page is not reported to anyone.
pub fn html(page: &Page<'_>) -> String {
    // Inside a script element only `</` and `<!--` have a meaning.
    let data = page.data.to_string().replace('<', "\\u003c");
    let title = page.title.replace('&', "&amp;").replace('<', "&lt;");
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n\
         <title>{title}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{}</style>\n</head>\n<body>\n<script type=\"application/json\" id=\"data\">{data}</script>\n<script>\n(() => {{\n{}\n}})();\n</script>\n</body>\n</html>\n",
        page.style,
        page.scripts.join("\n")
    )
}
