"""The documentation site: `./dev docs` builds it from the Markdown files of the whole repository."""

import pathlib
import sys

root = pathlib.Path(__file__).parent.parent
sys.path.insert(0, str(root / "build/python"))

project = "ensonify"
extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc"]
root_doc = "doc/index"
# Pages stay where their subject is, so that their links also work in the repository.
include_patterns = ["*.md", "doc/**.md", "scenes/**.md", "bench/**.md", "engine/**.md", "refine/*.md",
                    "scatter/*.md"]
exclude_patterns = ["build"]
myst_heading_anchors = 4

html_theme = "furo"
html_title = "ensonify"
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False

breathe_projects = {"ensonify": str(root / "build/docs/doxygen/xml")}
breathe_default_project = "ensonify"
breathe_default_members = ("members", "undoc-members")
autodoc_member_order = "bysource"
# Types of the standard library and of Eigen have no page here.
nitpick_ignore_regex = [("cpp:.*", ".*"), ("py:.*", ".*")]
