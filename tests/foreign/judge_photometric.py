"""What readers of others make of photometric files: every table that each of them finds in a folder's lamp.ies, lamp.ldt,
lamp.tm33.xml and lamp.gldf.

    python judge_photometric.py FOLDER answer.json

The answer is {"tables": [{"reader", "file", "planes", "angles", "cd": [plane][angle]}, ...], "missing": [reader, ...]}.
"""

import importlib
import json
import pathlib
import sys
import tempfile
import zipfile


def table(planes, angles, rows, factor=1.0):
    return {"planes": [float(c) for c in planes], "angles": [float(g) for g in angles],
            "cd": [[factor * float(i) for i in row] for row in rows]}


def of_eulumdat(module, lamp):
    """Its intensities are cd per 1000 lm of the first lamp set."""
    return table(lamp.c_angles, lamp.g_angles, lamp.intensities, lamp.lamp_sets[0].total_luminous_flux / 1000)


def eulumdat_ies(module, path):
    return of_eulumdat(module, module.Eulumdat.from_ies_file(str(path)))


def eulumdat_ldt(module, path):
    return of_eulumdat(module, module.Eulumdat.from_file(str(path)))


def eulumdat_tm33(module, path):
    """Of a TM-33 file it hands on the candela as they are, without a flux that they are relative to."""
    lamp = module.Eulumdat.parse(module.AtlaDocument.from_file(str(path)).to_ldt())
    return table(lamp.c_angles, lamp.g_angles, lamp.intensities)


def photompy_ies(module, path):
    lamp = module.IESFile.read(str(path))
    values = lamp.photometry.values * lamp.header.multiplier * lamp.header.ballast_factor
    return table(lamp.photometry.phis, lamp.photometry.thetas, values)


def photompy_ldt(module, path):
    lamp = module.LDTFile.read(str(path))
    return table(lamp.photometry.phis, lamp.photometry.thetas, lamp.photometry.values)


def pyldt_ldt(module, path):
    lamp = module.LdtReader.read(str(path))
    return table(lamp.header.c_angles, lamp.header.g_angles, lamp.intensities, lamp.header.lamp_flux[0] / 1000)


def gldf_ldt(module, path):
    """The container as this reader takes it apart, the photometry by the name that it found."""
    product = json.loads(module.gldf_to_json(str(path)))
    names = [file["$text"] for file in product["GeneralDefinitions"]["Files"]["File"] if file["@contentType"] == "ldc/eulumdat"]
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(path) as archive:
        return pyldt_ldt(importlib.import_module("pyldt"), archive.extract(f"ldc/{names[0]}", folder))


READERS = [("eulumdat", eulumdat_ies, "lamp.ies"), ("eulumdat", eulumdat_ldt, "lamp.ldt"), ("eulumdat", eulumdat_tm33, "lamp.tm33.xml"),
           ("photompy", photompy_ies, "lamp.ies"), ("photompy", photompy_ldt, "lamp.ldt"), ("pyldt", pyldt_ldt, "lamp.ldt"),
           ("gldf_rs_python", gldf_ldt, "lamp.gldf")]


def main(folder, answer):
    tables, missing = [], []
    for name, read, file in READERS:
        try:
            module = importlib.import_module(name)
        except ImportError:
            missing.append(name)
            continue
        tables.append({"reader": name, "file": file, **read(module, pathlib.Path(folder) / file)})
    pathlib.Path(answer).write_text(json.dumps({"tables": tables, "missing": sorted(set(missing))}))


if __name__ == "__main__":
    main(*sys.argv[1:])
