"""Story files: YAML that a user writes."""

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from artigrasp.config import from_dict
from artigrasp.config.story import StoryConfig
from artigrasp.errors import UserError
from artigrasp.files import check_format

FORMAT, VERSION = "artigrasp.story", 1
LARGEST_SIZE = 100_000
"""Of a story file [bytes]."""


class _Loader(yaml.SafeLoader):
    """Plain data only, and no key twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """A table.

        Raises:
            yaml.YAMLError: A key is there twice.
        """
        seen = set()
        for key, _ in node.value:
            if str(key.value) in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key.value!r} is there twice", key.start_mark
                )
            seen.add(str(key.value))
        table: dict[Hashable, Any] = super().construct_mapping(node, deep)
        return table


def read_story(path: Path) -> StoryConfig:
    """Read a story.

    Raises:
        UserError: The file is missing, no YAML, of another format or a newer version, or holds a key or a value that no
            story has; names the file and the key, and suggests the nearest.
    """
    try:
        if path.stat().st_size > LARGEST_SIZE:
            raise UserError(f"{path}: expected at most {LARGEST_SIZE} bytes, found {path.stat().st_size}")
        content = yaml.load(path.read_text(encoding="utf-8"), Loader=_Loader)
    except OSError as error:
        raise UserError(f"{path}: cannot read this file: {error.strerror}") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        problem = " ".join(str(error).split()) or type(error).__name__
        raise UserError(f"{path}: expected YAML, found something else: {problem}") from error
    if not isinstance(content, dict):
        raise UserError(f"{path}: expected a table of keys and values, found {type(content).__name__}")
    check_format(content.pop("format", None), content.pop("version", None), FORMAT, VERSION, path)
    return from_dict(StoryConfig, content, source=str(path))
