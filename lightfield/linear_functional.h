// Radiance, irradiance, intensity and flux as what they are: linear in the coefficients
// (docs/theory.md 2 and 7).
//
//   Q = sum over m, channel, texel of weight C,      weight laid out as LightField::data
//
// A single-channel field is its luminance; of three channels Q is the luminance (core/colour.h).
// Weights in double.
#pragma once

#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::lightfield {

using Weights = std::vector<double>;

// L(u->s), the mean over the texel that s lies in but for the angle, which is that of s; zero
// outside lattice and supports.
Weights RadianceWeights(const LuminaireGeometry& geometry, Vec2 u, Vec2 s);

// E_n(p) for a unit normal n towards the lamp. Throws InputError where z <= 0 or the receiver's
// horizon cuts the supports: the weights would not be the closed form's.
Weights IrradianceWeights(const LuminaireGeometry& geometry, Vec3 p, Vec3 n);

// Far-field intensity in a direction, any but 0; none where its z <= 0.
Weights IntensityWeights(const LuminaireGeometry& geometry, Vec3 direction);

Weights FluxWeights(const LuminaireGeometry& geometry);

double Apply(const Weights& weights, const LightField& field);

}  // namespace luxfield::lightfield
