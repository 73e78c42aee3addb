"""`hovi schema`: the JSON schema of scene files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def schema(
    out: Annotated[
        Path | None, typer.Option(metavar="JSON", help="Path of the schema; default: print it.")
    ] = None,
) -> None:
    """Write the JSON schema of scene files, for editors that complete and check TOML."""
    from json import dumps

    from hovi.cli.arguments.files import check_output
    from hovi.errors import InputError
    from hovi.planning.task_file.json_schema import json_schema
    from hovi.system.files import reason, whole_file

    text = dumps(json_schema(), indent=2)
    if out is None:
        print(text)
        return
    check_output(out, ".json")
    try:
        with whole_file(out) as stream:
            stream.write(text.encode() + b"\n")
    except OSError as error:
        raise InputError(f"cannot write {str(out)!r}: {reason(error)}.") from error
    print(f"wrote {out}")
