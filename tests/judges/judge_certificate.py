"""A certificate against its published schema, docs/formats/certificate.schema.json, and against what
`luxfield photometry` says of the same lamp."""

import hashlib
import json
import unittest

import numpy as np

from model import Geometry, LightField
from program import SOURCE, Judgement
from schema import mistakes

SCHEMA = SOURCE / "docs/formats/certificate.schema.json"


class Certificate(Judgement):
    def lamp(self):
        g = Geometry(delta=0.3, basis="bspline2", width=3, height=3, u0=-0.05, v0=-0.05, h=0.02, s0=-0.2,
                     t1=0.2, ds=0.04, dt=0.04, columns=10, rows=10)  # fmt: skip
        c = 1e5 * np.random.default_rng(3).uniform(0.5, 1, (3, 3, 10, 10, 1))
        return LightField(g, c.astype(np.float32).astype(float))

    def test_expanded_uncertainty(self):
        """Of coefficients that are independent, since the file does not say how it was solved: of the
        flux by its value for every coefficient alone, with k = 2."""
        field = self.lamp()
        g = field.geometry
        field.write(self.folder / "x.lf.exr")
        sigma = 100 * np.random.default_rng(5).uniform(1, 3, field.c.shape).astype(np.float32)
        LightField(g, sigma.astype(float)).write(self.folder / "x.sigma.lf.exr")
        told = self.figures("photometry", "x.lf.exr", "--sigma", "x.sigma.lf.exr", "-o", "x.cert.json")
        variance = 0.0
        for index in np.ndindex(*field.c.shape):
            one = LightField(g, np.zeros(field.c.shape))
            one.c[index] = 1
            variance += (one.flux()[0] * sigma[index]) ** 2
        results = json.loads((self.folder / "x.cert.json").read_text())["results"]
        for result in results:
            self.assertAlmostEqual(result["U"], 2 * result["u_noise"], delta=1e-9 * result["U"])
        flux = results[0]
        self.assertEqual(flux["unit"], "lm")
        self.assertEqual(flux["value"], told["flux_lm"])
        self.assertLess(abs(flux["U"] / (2 * np.sqrt(variance)) - 1), 1e-4)

    def test_is_as_its_schema_says(self):
        self.lamp().write(self.folder / "x.lf.exr")
        self.write("ask.toml", '[[point]]\nposition_m = [0.1, 0, 1]\n[certificate]\nlamp = "A & B"\n')
        told = self.figures("photometry", "x.lf.exr", "--ask", "ask.toml", "-o", "x.cert.json")
        certificate = json.loads((self.folder / "x.cert.json").read_text())
        schema = json.loads(SCHEMA.read_text())
        self.assertEqual(mistakes(certificate, schema), [])
        self.assertGreater(len(certificate["photometry"]), 20)
        for key, value in certificate["photometry"].items():
            self.assertEqual(value, told[key], key)
        self.assertEqual(certificate["laboratory"]["lamp"], "A & B")
        for file in certificate["files"]:
            digest = hashlib.sha256((self.folder / file["file"]).read_bytes()).hexdigest()
            self.assertEqual(file["sha256"], digest)
        # And the schema refuses what is wrong.
        for spoil in (lambda c: c.pop("files"), lambda c: c["results"].clear(),
                      lambda c: c["results"][0].update(value="5"), lambda c: c.update(more=1),
                      lambda c: c["files"][0].update(sha256="0815")):  # fmt: skip
            spoilt = json.loads(json.dumps(certificate))
            spoil(spoilt)
            self.assertNotEqual(mistakes(spoilt, schema), [])


if __name__ == "__main__":
    unittest.main()
