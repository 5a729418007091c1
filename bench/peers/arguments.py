import argparse
import pathlib
import sys


def parse(description):
    """SCENE.json and how it is rendered; with Blender's own arguments before a `--`."""
    words = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("scene", type=pathlib.Path, nargs="?", help="scene.json of export.py")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="EXR of the radiance")
    parser.add_argument("--spp", type=int, default=64, help="samples a pixel")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=0, help="0: all cores")
    parser.add_argument("--version", action="store_true", help="only say which version is there")
    arguments = parser.parse_args(words)
    if not arguments.version and (arguments.scene is None or arguments.output is None):
        parser.error("SCENE.json and -o FILE.exr are required")
    return arguments
