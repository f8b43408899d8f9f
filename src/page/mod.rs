//! Pages of one file: style, data and scripts in it, nothing from elsewhere.

use serde_json::Value;

/// Parts of a page.
#[derive(Debug)]
pub struct Page<'a> {
    /// In the window's bar.
    pub title: &'a str,
    /// CSS.
    pub style: &'a str,
    /// What the scripts read, by `document.getElementById("data")`.
    pub data: &'a Value,
    /// JavaScript, in order; they share one scope of their own.
    pub scripts: &'a [&'a str],
}

/// The file. Its policy forbids every request, so that a page that was mailed tells nobody that it was opened.
pub fn html(page: &Page<'_>) -> String {
    // Inside a script element only `</` and `<!--` mean anything.
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
