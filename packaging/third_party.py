"""Prints the libraries that are part of the programs, with the texts of their licences, each text once."""

import json
import pathlib
import subprocess

PROGRAMS = ["isotherm", "isotherm-replay-tool", "isotherm-calibration", "isotherm-ros"]
NAMES = ("LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE")


def cargo(*arguments: str) -> str:
    command = ["cargo", *arguments, "--locked"]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def main() -> None:
    metadata = json.loads(cargo("metadata", "--format-version", "1"))
    packages = {f"{package['name']} v{package['version']}": package for package in metadata["packages"]}
    host = [line.split()[1] for line in subprocess.check_output(["rustc", "-vV"], text=True).splitlines() if line.startswith("host")]
    tree = ["tree", "--edges", "normal", "--prefix", "none", "--target", host[0]]
    for program in PROGRAMS:
        tree += ["--package", program]
    used = {" ".join(line.split()[:2]) for line in cargo(*tree).splitlines() if line}
    texts: dict[str, list[str]] = {}
    print("Libraries that are part of isotherm, isotherm-replay, isotherm-calibrate and isotherm-ros, and their licences.\n")
    for name in sorted(used):
        package = packages[name]
        if package["source"] is None:
            continue
        print(f"{name}: {package['license']}")
        folder = pathlib.Path(package["manifest_path"]).parent
        for path in sorted(folder.iterdir()):
            if path.is_file() and path.name.upper().startswith(NAMES):
                texts.setdefault(path.read_text(errors="replace").strip(), []).append(name)
    for text, names in sorted(texts.items(), key=lambda item: item[1]):
        print(f"\n{'=' * 100}\n{', '.join(names)}:\n\n{text}")


if __name__ == "__main__":
    main()
