"""Hook of hatchling: builds the interface packages into the wheel."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

sys.path.insert(0, str(Path(__file__).parent))

from generate import PACKAGES, BuildError, build_all

FALLBACK = "bioscara_ros_fallback"


class InterfacesHook(BuildHookInterface[Any]):
    """Adds the built packages to a wheel, below the package that makes them importable."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the packages.

        Args:
            version: ``standard`` or ``editable``.
            build_data: What hatchling puts into the wheel.

        Raises:
            SystemExit: They cannot be built; the message is what pip shows.
        """
        if self.target_name != "wheel":
            return
        self._out = tempfile.TemporaryDirectory(prefix="bioscara-interfaces-")
        out = Path(self._out.name)
        try:
            build_all(out)
        except BuildError as error:
            sys.exit(str(error))
        python = Path(self.root) / "python"
        files = {
            str(python / FALLBACK / "__init__.py"): f"{FALLBACK}/__init__.py",
            str(python / f"{FALLBACK}.pth"): f"{FALLBACK}.pth",
            **{str(out / package): f"{FALLBACK}/{package}" for package in PACKAGES},
        }
        build_data["force_include_editable" if version == "editable" else "force_include"] = files
        build_data["pure_python"] = False
        build_data["infer_tag"] = True

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the built files, now that the wheel has it."""
        if self.target_name == "wheel":
            self._out.cleanup()
