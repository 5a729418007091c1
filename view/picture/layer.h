// What false colours show of a picture: its values, or what is known of how they came about.
#pragma once

#include <optional>
#include <string>

#include "luxfield/render/feedback.h"
#include "luxfield/render/film/film.h"

namespace luxfield::view {

enum class Layer {
  kRadiance,
  kIrradiance,
  kCoverage,    // share of the pixel's samples that hit something
  kSamples,     // light samples a pixel
  kNoise,       // standard deviation of the luminance over the picture's mean
  kLab,         // CIE 1976 difference to a reference, after the exponential operator
  kLightShare,  // render::Feedback's, as kImageShare
  kImageShare,
};

// What layers show that is no part of the frame; null: there is none.
struct LayerSources {
  const core::Image* reference = nullptr;      // of kLab: radiance
  const render::Feedback* feedback = nullptr;  // of a picture of any size, of the same view
};

// Whether it shows render::Feedback.
bool IsFeedback(Layer layer);

// Whether a frame has it; kLab where the reference is of the frame's size.
bool HasLayer(const render::Frame& frame, Layer layer, const LayerSources& sources);

// Of the frame's size: one channel, or three for radiance and irradiance; NaN where feedback tells
// nothing. The frame has the layer.
core::Image LayerOf(const render::Frame& frame, Layer layer, const LayerSources& sources);

// Colours of coverage, shares and Lab differences rise linearly, from 0; those of others with the
// logarithm.
bool IsLinear(Layer layer);

// What its colours span where nobody says otherwise: 0 to 1 of coverage and shares, 0 to 10 of Lab
// differences, else render::AutomaticScale, of samples from 1 on.
render::FalseColourScale AutomaticScaleOf(const core::Image& values, Layer layer);

// 0 at the scale's lowest value, 1 at its highest; empty for values that a logarithm has no place
// for, which are black.
std::optional<double> PositionOn(const render::FalseColourScale& scale, Layer layer, double value);

// "illuminance in lx, direct light only", "light samples a pixel".
std::string QuantityOf(Layer layer, lightfield::FluxUnit unit);

}  // namespace luxfield::view
