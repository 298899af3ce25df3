"""`bioscara export`, as it is typed."""

from __future__ import annotations

from pathlib import Path

from cli.said import Said


def test_it_says_what_it_wrote_and_what_it_refuses(said: Said, tmp_path: Path) -> None:
    folder = tmp_path / "for others"
    assert said.output("export urdf", str(folder)) == (
        f"wrote {folder}/bioscara.urdf and 51 meshes that it names\n"
    )
    assert "name another one" in said.refusal("export glb", str(folder))
    assert said.output("export glb", f"{folder}2") == f"wrote {folder}2/bioscara.glb\n"
    assert "FORMAT is one of mjcf, urdf, glb" in said.refusal("export sdf", str(folder))
    assert "needs DIR" in said.refusal("export mjcf")
    overlay = tmp_path / "longer.yaml"
    overlay.write_text("geometry:\n  upper_arm: 0.4\n")
    refused = said.refusal(f"export glb {tmp_path}/new --parameters {overlay}")
    assert "geometry.upper_arm" in refused
    assert not (tmp_path / "new").exists()
