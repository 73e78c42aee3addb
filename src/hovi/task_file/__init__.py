"""Task files: a scene, its two ends and how to plan between them, written in TOML."""

from hovi.task_file.json_schema import json_schema
from hovi.task_file.reading import load_task
from hovi.task_file.task import Task
from hovi.task_file.writing import save_task

__all__ = ["Task", "json_schema", "load_task", "save_task"]
