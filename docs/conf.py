"""The site: built by tests/site from docs/ and the README files of results/."""

project = "Vibrissa"
author = "The Vibrissa authors"
copyright = author
extensions = ["myst_parser", "sphinx-mathjax-offline"]
include_patterns = ["docs/**.md", "results/*/*.md"]
exclude_patterns = ["target/**", "pages/**", "**/node_modules", ".git/**", "python/**", "tests/**"]
root_doc = "docs/index"
myst_enable_extensions = ["dollarmath", "deflist", "attrs_inline"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
html_theme = "furo"
html_title = "Vibrissa"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_extra_path = ["root"]
html_copy_source = False
html_show_sphinx = False
suppress_warnings = ["misc.highlighting_failure", "toc.no_title"]
nitpicky = True


def whole_equations(app, doctree):
    """Numbered equations as they are written: Sphinx would put several lines into an environment that allows no number."""
    from docutils import nodes

    for node in doctree.findall(nodes.math_block):
        if r"\tag" in node.astext():
            text = f"\\begin{{equation}}{node.astext()}\\end{{equation}}"
            node.children = [nodes.Text(text)]
            node["no-wrap"] = True


def setup(app):
    app.connect("doctree-read", whole_equations)
