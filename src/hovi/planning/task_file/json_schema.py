"""The JSON schema of scene files, generated from the classes that validate them.

With it editors complete and check scene files: run `hovi schema --out scene.schema.json` and put
`#:schema scene.schema.json` into the first line of the file.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, create_model

from hovi.effects import REGISTRY
from hovi.planning.task_file.effect_tables import effect_schema
from hovi.planning.task_file.schema import (
    Bare,
    GoalTable,
    GraspedTable,
    LimitsName,
    LimitsTable,
    SegmentTable,
    StartTable,
    Table,
    TaskTable,
)

_Entries = dict[str, Any]
_NO_DEFAULT = ("default", None)
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema() -> dict[str, Any]:
    """The JSON schema of scene files, for the data parsed from TOML."""
    effects: dict[str, Any] = {
        key: (effect_schema(effect) | None, Field(default=None, description=_purpose(effect)))
        for key, effect in REGISTRY.items()
    }
    limits = LimitsName | LimitsTable
    simulated = create_model("EffectsTable", __base__=Table, **effects) | None
    own: dict[str, Any] = {
        "effects": (simulated, Field(default=None, description="tables of effects")),
        "limits": (limits | None, SegmentTable.model_fields["limits"]),
        "goal": (GoalTable | list[GoalTable] | Bare | None, SegmentTable.model_fields["goal"]),
        "grasped": (list[GraspedTable] | GraspedTable, SegmentTable.model_fields["grasped"]),
    }
    segment = create_model("Segment", __base__=SegmentTable, __doc__="[[segments]].", **own)
    keys: dict[str, Any] = {
        "effects": (
            simulated,
            Field(default=None, description="tables [effects.NAME]: what is simulated"),
        ),
        "segments": (list[segment], TaskTable.model_fields["segments"]),  # type: ignore[valid-type]
        "limits": (limits, Field(default="urdf", description="what bounds the motion")),
        "start": (StartTable | Bare, TaskTable.model_fields["start"]),
        "goal": (GoalTable | list[GoalTable] | Bare | None, TaskTable.model_fields["goal"]),
        "obstacles": (list[_Entries] | _Entries, TaskTable.model_fields["obstacles"]),
        "keep": (list[_Entries] | _Entries, TaskTable.model_fields["keep"]),
        "grasped": (list[GraspedTable] | GraspedTable, TaskTable.model_fields["grasped"]),
        "guess": (Literal["cubic", "minimum-jerk"], TaskTable.model_fields["guess"]),
        "tolerance": (
            float | str | None,
            Field(default=None, description=TaskTable.model_fields["tolerance"].description),
        ),
    }
    whole = create_model("SceneFile", __base__=TaskTable, __doc__="A scene file of hovi.", **keys)
    motions = [{"required": ["duration", "goal"]}, {"required": ["segments"]}]
    return {"$schema": DIALECT, **_without_null(whole.model_json_schema()), "oneOf": motions}


def _without_null(part: Any) -> Any:
    """The schema without null, which TOML does not have, and without null defaults."""
    if isinstance(part, list):
        return [_without_null(each) for each in part if each != {"type": "null"}]
    if not isinstance(part, dict):
        return part
    kept = {key: _without_null(each) for key, each in part.items() if (key, each) != _NO_DEFAULT}
    if isinstance(kept.get("default"), dict):
        kept["default"] = {k: v for k, v in kept["default"].items() if v is not None}
    only = kept.pop("anyOf", ())
    if len(only) == 1:
        return {**only[0], **kept}
    return {"anyOf": only, **kept} if only else kept


def _purpose(effect: type) -> str:
    """The first line of a class's docstring."""
    return (effect.__doc__ or "").strip().splitlines()[0]
