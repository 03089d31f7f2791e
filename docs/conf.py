"""The site: ``make docs`` builds it, strictly, into ``build/docs``."""

from hrcneuro import __version__

project = "hrcneuro"
author = "The hrcneuro founders"
project_copyright = "the hrcneuro founders, BSD-3-Clause"
version = release = __version__

extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
# Links to headings are checked as links to pages are.
myst_heading_anchors = 4
myst_enable_extensions = ["deflist"]
nitpicky = True
highlight_language = "text"
suppress_warnings = ["misc.highlighting_failure", "myst.header"]

html_theme = "furo"
html_title = "hrcneuro"
html_show_sphinx = False
html_copy_source = False
# No font, script or image comes from elsewhere: the site works offline.
html_theme_options = {"top_of_page_buttons": []}
