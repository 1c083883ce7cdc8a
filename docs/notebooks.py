"""Notebooks as pages: every cell run, with its outcome below it."""

import ast
import contextlib
import io
import json
import tempfile
from pathlib import Path
from typing import Any


def write(sources: Path, folder: Path) -> None:
    """Write the page of every notebook into a folder; what cells compute is not kept."""
    folder = folder.resolve()
    for source in sorted(sources.resolve().glob("*.ipynb")):
        with tempfile.TemporaryDirectory() as away, contextlib.chdir(away):
            text = page(source, folder)
        (folder / f"{source.stem}.md").write_text(text, encoding="utf-8")


def page(source: Path, folder: Path) -> str:
    """Run the cells of a notebook in their order, in one name space; the page as Markdown.

    Parameters
    ----------
    source : Path
        The notebook, whose own outputs do not count.
    folder : Path
        Takes the figures; `results/` of the working directory takes what cells compute.
    """
    space: dict[str, Any] = {}
    parts, figures = [], 0
    for cell in json.loads(source.read_text(encoding="utf-8"))["cells"]:
        text = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(text)
            continue
        said, value = _run(text, space)
        parts.append(f"```python\n{text}\n```")
        if hasattr(value, "savefig"):
            figures += 1
            name = f"{source.stem}-{figures}.png"
            value.savefig(folder / name)
            parts.append(f"![]({name})")
        elif said or value is not None:
            shown = said + ("" if value is None else repr(value))
            parts.append(f"```text\n{shown.rstrip()}\n```")
    return "\n\n".join(parts) + "\n"


def _run(text: str, space: dict[str, Any]) -> tuple[str, Any]:
    """Run a cell; what it prints, and the value of its last line if that is an expression."""
    tree, value = ast.parse(text), None
    last = tree.body[-1]
    with contextlib.redirect_stdout(io.StringIO()) as out:
        if isinstance(last, ast.Expr):
            tree.body.pop()
        exec(compile(tree, "cell", "exec"), space)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), space)
    return out.getvalue(), value
