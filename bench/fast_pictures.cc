#include "luxfield/bench/fast_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/render/accuracy/picture_noise.h"
#include "luxfield/scene/scene.h"

namespace luxfield::bench {
namespace {

using render::RenderOptions;
using render::Shadows;

// A picture's options and the words for them.
struct Way {
  RenderOptions options;
  std::string words;
};

struct Pair {
  std::string name;
  Way fast, reference;
};

std::string Words(const RenderOptions& options, bool samples) {
  std::string words = options.estimator;
  if (samples) words += fmt::format(", {} samples a pixel", options.samples_per_pixel);
  words += options.shadows == Shadows::kNone
               ? ", no shadows"
               : fmt::format(", shadows: {}", render::ShadowsName(options.shadows));
  if (options.matt) words += ", matt";
  return words;
}

Way Lit(const RenderOptions& common, const std::string& estimator, Shadows shadows, int samples) {
  Way way{common, ""};
  way.options.estimator = estimator;
  way.options.shadows = shadows;
  if (samples > 0) way.options.samples_per_pixel = samples;
  way.words = Words(way.options, samples > 0);
  return way;
}

Way Matt(Way way, int samples) {
  way.options.matt = true;
  way.words = Words(way.options, samples > 0);
  return way;
}

// Lights drawn by the tree over them, against some samples of each.
Pair DrawnLights(const RenderOptions& common, int samples, std::size_t lights) {
  Pair pair{"drawn-lights", Lit(common, "cells", Shadows::kTraced, samples),
            Lit(common, "cells", Shadows::kTraced, samples)};
  pair.reference.options.light_samples.assign(lights, samples);
  pair.reference.words = fmt::format("cells, {} samples of each light, shadows: traced", samples);
  return pair;
}

RenderOptions CommonOptions(const FastPicturesOptions& options) {
  RenderOptions common;
  common.width = options.width;
  common.height = options.height;
  common.seed = options.seed;
  common.approximation_error = options.approximation_error;
  return common;
}

std::vector<Pair> PairsOf(const FastPicturesOptions& options, const render::LitScene& scene) {
  const RenderOptions common = CommonOptions(options);
  const int few = options.samples_per_pixel, many = options.reference_samples;
  std::vector<Pair> pairs;
  pairs.push_back({"volume", Matt(Lit(common, "volume", Shadows::kNone, 0), 0),
                   Matt(Lit(common, "exact", Shadows::kNone, 0), 0)});
  pairs.push_back({"soft-maps", Matt(Lit(common, "volume", Shadows::kSoftMaps, 0), 0),
                   Matt(Lit(common, "exact", Shadows::kTraced, many), many)});
  if (scene.geometry().glossy) {
    Pair gloss{"gloss", Lit(common, "gloss", Shadows::kNone, 0),
               Lit(common, "gloss", Shadows::kNone, 0)};
    gloss.reference.options.approximation_error /= 10;
    for (Way* way : {&gloss.fast, &gloss.reference})
      way->words += fmt::format(", for {:.2g} %", 100 * way->options.approximation_error);
    pairs.push_back(gloss);
  }
  const Way truth = Lit(common, "cells", Shadows::kTraced, many);
  for (const std::string estimator : {"cells", "windowed"})
    pairs.push_back({estimator, Lit(common, estimator, Shadows::kTraced, few), truth});
  if (const std::size_t lights = scene.Lights().size(); lights > 1)
    pairs.push_back(DrawnLights(common, few, lights));
  // References draw other random numbers.
  for (Pair& pair : pairs) ++pair.reference.options.seed;
  return pairs;
}

render::Frame Taken(render::LitScene& scene, const RenderOptions& options) {
  return render::Renderer(scene, options).Render();
}

double MeanVariance(const render::Frame& frame) { return render::NoiseOf(frame, 1).mean_variance; }

FastPicture Compared(const Pair& pair, render::Frame fast, render::Frame reference) {
  FastPicture picture{
      pair.name, pair.fast.words, pair.reference.words, std::move(fast), std::move(reference), {},
      0};
  picture.difference = core::Compare(picture.fast.radiance, picture.reference.radiance);
  const double mean = render::NoiseOf(picture.reference, 1).mean_luminance;
  if (mean > 0)
    picture.noise = std::sqrt(MeanVariance(picture.fast) + MeanVariance(picture.reference)) / mean;
  return picture;
}

FastPicture RayBatches(const scene::Scene& scene, render::LitScene& lit,
                       const FastPicturesOptions& options) {
  const Way way = Lit(CommonOptions(options), "cells", Shadows::kTraced, options.samples_per_pixel);
  Pair pair{"ray-batches", way, way};
  pair.fast.words += ", rays in Embree's batches";
  pair.reference.words += ", the same rays in the kernel";
  const render::Device& device = lit.device();
  render::LitScene by_kernel(device.WithTuning(render::ParseTuning("rays=0", device.tuning())),
                             scene);
  FastPicture picture = Compared(pair, Taken(lit, way.options), Taken(by_kernel, way.options));
  picture.noise = 0;  // both have the same
  return picture;
}

}  // namespace

std::vector<FastPicture> MakeFastPictures(const FastPicturesOptions& options) {
  if (std::min({options.width, options.height, options.samples_per_pixel,
                options.reference_samples}) < 1)
    throw InputError("bench pictures: width, height and samples must be at least 1");
  const scene::Scene scene = scene::ReadScene(options.scene);
  if (scene.luminaires.empty())
    throw InputError(options.scene.string(),
                     "has no [[luminaire]] with a light field, which fast ways are for",
                     "give a scene with one");
  const auto device = render::Device::Open(options.device, options.threads);
  render::LitScene lit(device, scene);
  std::vector<FastPicture> pictures;
  for (const Pair& pair : PairsOf(options, lit))
    pictures.push_back(
        Compared(pair, Taken(lit, pair.fast.options), Taken(lit, pair.reference.options)));
  if (device.tuning().host_rays) pictures.push_back(RayBatches(scene, lit, options));
  return pictures;
}

}  // namespace luxfield::bench
