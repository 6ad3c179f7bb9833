"""The wheel `sdrlinkd` needs the wheel `sdrlinkd-client` of the same version.

Both put files into the folder `sdrlinkd` of an environment, and no file is in both: the client's
wheel has `sdrlinkd/__init__.py`, `sdrlinkd/client` and `sdrlinkd/calls`, the daemon's has the rest.
A checkout that is installed to be edited has all of it.
"""

from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class NeedsTheClient(BuildHookInterface[Any]):
    """Adds the requirement, with the version of this source."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called before a wheel is made; `version` is "standard" or "editable"."""
        if version == "standard":
            build_data["dependencies"].append(f"sdrlinkd-client=={self.metadata.version}")
