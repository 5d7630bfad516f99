"""The site: ``python -m sphinx -W --keep-going docs site`` (needs ``pip install '.[docs]'``)."""

import ast
import sys
from importlib import import_module
from pathlib import Path

DOCS = Path(__file__).resolve().parent
SOURCE = DOCS.parent / "src"
sys.path.insert(0, str(SOURCE))

import gmwm  # noqa: E402
import gmwm.ins  # noqa: E402

project, author, copyright = "gmwm", "the gmwm authors", "the gmwm authors"
version = release = gmwm.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]
# "n" in the type "(n, 3) ndarray" is looked up as a name, and found several times.
suppress_warnings = ["ref.python"]
default_role = "code"  # `name` in a docstring

napoleon_google_docstring = False
napoleon_use_ivar = True  # attributes stand in the class's own text, once
napoleon_use_rtype = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the text has the types, with their shapes and units

html_theme = "furo"  # dark and light
html_title = f"gmwm {release}"
html_copy_source = html_show_sourcelink = False

ROOMS = {
    "readers": "Recordings", "diagnosis": "Health of a recording",
    "variance": "Wavelet and Allan variance", "process": "Processes and models",
    "estimate": "Estimation", "selection": "Selection", "calibration": "Calibration",
    "datasheet": "Data sheets", "motion": "Noise in motion",
    "population": "Several recordings, many units",
    "filter_numbers": "Filter numbers and error budget", "export": "Files for other programs",
    "ins": "Navigation", "errors": "Errors",
}  # fmt: skip
"""Room -> title of its page."""


def public_names(stub: Path) -> dict[str, list[str]]:
    """Names of a face by the room that they come from, as its stub lists them."""
    found: dict[str, list[str]] = {}
    for node in ast.parse(stub.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [alias.name for alias in node.names]
            if names == ["*"]:
                names = list(import_module(f"gmwm.{node.module}").__all__)
            found.setdefault(node.module.partition(".")[0], []).extend(names)
    return found


def page(title: str, module: str, names: list[str]) -> str:
    """A page of classes and functions."""
    lines = [title, "=" * len(title), ""]
    for name in sorted(names, key=str.lower):
        value = getattr(sys.modules[module], name)
        kind = "class" if isinstance(value, type) else "function" if callable(value) else "data"
        lines += [name, "-" * len(name), "", f".. auto{kind}:: {module}.{name}"]
        lines += ["   :members:"] if kind == "class" else []
        lines += [""]
    return "\n".join(lines)


def write_reference(app: object) -> None:
    """One page a room of the public face, and one of `gmwm.ins`, in docs/api."""
    rooms = public_names(SOURCE / "gmwm" / "__init__.pyi")
    pages = {room: page(ROOMS[room], "gmwm", names) for room, names in rooms.items()}
    inside = public_names(SOURCE / "gmwm" / "ins" / "__init__.pyi")
    names = [name for each in inside.values() for name in each]
    pages["ins"] = page(ROOMS["ins"], "gmwm.ins", names)
    title = "Reference"
    toc = "\n".join(f"   {room}" for room in ROOMS if room in pages)
    pages["index"] = f"{title}\n{'=' * len(title)}\n\n.. toctree::\n   :maxdepth: 1\n\n{toc}\n"
    folder = DOCS / "api"
    folder.mkdir(exist_ok=True)
    for name, text in pages.items():
        path = folder / f"{name}.rst"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def setup(app) -> None:
    app.connect("builder-inited", write_reference)
