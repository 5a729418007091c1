"""What `luxfield photometry` writes as JSON against its published schema,
docs/formats/photometry.schema.json: of everything that can be asked for, with sigma and without, of
three channels and one, and of a dark lamp."""

import json
import unittest

import numpy as np

import judge_photometry
from model import LightField
from program import SOURCE, Judgement
from schema import mistakes

SCHEMA = json.loads((SOURCE / "docs/formats/photometry.schema.json").read_text())
HEADLAMP = '[[headlamp]]\nregulation = "un-r149-01-passing-v"\naim_deg = [0, 0]\n'


class PhotometrySchema(Judgement):
    def told(self, field, channels, sigma):
        field.write(self.folder / "x.lf.exr")
        weighed = judge_photometry.WEIGHED.format(", ".join(["2.5"] * channels))
        self.write("ask.toml", judge_photometry.ASK + weighed + HEADLAMP)
        options = []
        if sigma:
            LightField(field.geometry, 0.01 * np.abs(field.c)).write(self.folder / "x.sigma.lf.exr")
            options = ["--sigma", "x.sigma.lf.exr"]
        told = self.figures("photometry", "x.lf.exr", "--ask", "ask.toml", "--c-step", 90,
                            "--gamma-step", 30, "-o", "x.json", *options)  # fmt: skip
        self.assertEqual(mistakes(told, SCHEMA), [])
        written = json.loads((self.folder / "x.json").read_text())
        self.assertEqual(mistakes(written, SCHEMA), [])
        return written

    def test_all_that_can_be_asked_for(self):
        random = np.random.default_rng(7)
        for channels, sigma in ((1, True), (3, False)):
            field = judge_photometry.lamp("bspline2", channels, random)
            told = self.told(field, channels, sigma)
            for key in ("points", "lines", "planes", "volumes", "paths", "eyes", "glare", "headlamps",
                        "weightings"):  # fmt: skip
                self.assertNotEqual(told[key], [], key)
        # The schema refuses what is wrong.
        for spoil in (lambda d: d.pop("quality"), lambda d: d["planes"][0].update(illuminance_fc=1),
                      lambda d: d["points"][0].update(position_m=[0, 1]),
                      lambda d: d.update(flux_lm="5"), lambda d: d.update(unit="lux"),
                      lambda d: d["headlamps"][0].update(verdict="perhaps"),
                      lambda d: d["paths"][0].update(time_s=None)):  # fmt: skip
            spoilt = json.loads(json.dumps(told))
            spoil(spoilt)
            self.assertNotEqual(mistakes(spoilt, SCHEMA), [])

    def test_of_a_dark_lamp(self):
        field = judge_photometry.lamp("box", 1, np.random.default_rng(7))
        self.told(LightField(field.geometry, 0 * field.c), 1, False)


if __name__ == "__main__":
    unittest.main()
