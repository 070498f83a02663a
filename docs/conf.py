"""How Sphinx builds the site: ``make docs``.

Every page of `start`, `tutorials` and `examples` is executed as it is built. What a page needs in a
browser comes from installed packages; nothing is fetched. A warning is an error.
"""

import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

# Pages run the command `sagnac` of this environment, and draw as the settings beside this file say.
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
os.environ["MATPLOTLIBRC"] = str(HERE / "_site")
os.environ["PYTHONPATH"] = sys.path[0]
os.environ["IPYTHONDIR"] = str(HERE / "_site" / "ipython")
os.environ["COLUMNS"] = "88"
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sagnac  # noqa: E402

project = "sagnac"
author = "the authors of sagnac"
release = sagnac.__version__
html_title = "sagnac"

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "sphinx_design",
    "cyclopts.ext.sphinx",
    "docs._site.extension",
]
templates_path = ["_site/templates"]
exclude_patterns = ["_build", "_site", "examples", "gallery/*.ipynb", "gallery/*.md5"]
nitpicky = False  # types in docstrings are words, not references; pages and headings are checked
suppress_warnings = ["config.cache"]  # the settings of the gallery hold functions

# --- pages that run ---------------------------------------------------------------------------
nb_execution_mode = "cache"
nb_execution_cache_path = str(HERE / "_build" / "executed")
nb_execution_in_temp = True
nb_execution_timeout = 1800  # of a cell; other work may share the machine
nb_execution_raise_on_error = True
nb_merge_streams = True
nb_output_stderr = "remove"  # progress of the commands
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist", "attrs_inline"]
myst_heading_anchors = 4
html_math_renderer = "mathml"

sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "filename_pattern": "/plot_",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e6,
    "write_computation_times": False,
    "abort_on_example_error": True,
    "image_scrapers": ("matplotlib",),
    "thumbnail_size": (400, 280),
    "plot_gallery": True,
}

# --- the library from its docstrings ----------------------------------------------------------
autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_class_signature = "mixed"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
default_role = "code"

# --- how it looks -----------------------------------------------------------------------------
html_theme = "pydata_sphinx_theme"
html_static_path = ["_site/static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "show_prev_next": True,
    "navigation_with_keys": False,
    "show_toc_level": 2,
    "header_links_before_dropdown": 8,
    "navbar_align": "left",
    "navbar_persistent": [],
    "navbar_end": ["search-button", "theme-switcher"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "tango",
}
html_sidebars = {"index": []}
copyright = "the authors of sagnac; Apache-2.0"
