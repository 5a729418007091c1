// Some pixels of a picture are lit again (render/film/relit_pixels.h): which, and what that tells.
#include <algorithm>
#include <cmath>

#include "luxfield/render/film/neighbours.h"
#include "luxfield/render/renderer.h"

namespace luxfield::render {

Renderer::LitPixels Renderer::PixelsOf(std::span<const EquallySampled> parts,
                                       std::span<const float> hits) {
  LitPixels lit;
  const auto add = [&](std::size_t pixel, std::size_t part) {
    lit.pixels.push_back(pixel);
    lit.part.push_back(part);
    lit.densities.push_back(static_cast<float>(parts[part].density));
  };
  for (std::size_t part = 0; part < parts.size(); ++part)
    if (parts[part].pixels.empty()) {
      for (std::size_t i = 0; i < hits.size(); ++i)
        if (hits[i] != 0) add(i, part);
    } else {
      for (const std::size_t i : parts[part].pixels) add(i, part);
    }
  return lit;
}

std::vector<float> Renderer::LitPixels::Guides(std::span<const float> stated, int width,
                                               int height) const {
  core::Image of_one(width, height, 1), counted(width, height, 1);
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    of_one.data[pixels[k]] = stated[k] * densities[k];
    counted.data[pixels[k]] = 1;
  }
  std::vector<float> guides;
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    const int pixel = static_cast<int>(pixels[k]);
    guides.push_back(static_cast<float>(MeanAround(of_one, counted, pixel / width, pixel % width)) /
                     densities[k]);
  }
  return guides;
}

void Renderer::Relight(std::span<const EquallySampled> parts, const GBuffer& gbuffer,
                       std::span<const float> hits, int pixel_sample, const PassSums& sums,
                       Frame& frame) {
  const LitPixels lit = PixelsOf(parts, hits);
  const auto stated = [&](std::size_t row) {
    const std::vector<float> of_band = sums.StatedVariances(row);
    std::vector<float> own;
    for (const std::size_t i : lit.pixels) own.push_back(of_band[i]);
    return own;
  };
  std::vector<std::vector<float>> of_lights;
  for (std::size_t row = 1; row < sums.rows(); ++row) of_lights.push_back(stated(row));
  const std::vector<float> of_all = stated(0);
  const auto draws =
      relit_.Choose(of_all, lit.Guides(of_all, gbuffer.width, gbuffer.height), of_lights);
  std::vector<std::vector<std::vector<double>>> luminance(
      sums.rows(), std::vector<std::vector<double>>(relit_.runs()));
  RenderTimes own;
  // Pixels, and so draws, come part by part.
  for (std::size_t begin = 0, end = 0; begin < draws.size(); begin = end) {
    const EquallySampled& part = parts[lit.part[draws[begin].pixel]];
    // A picture of the draws, in which a pixel may come twice.
    std::vector<std::size_t> drawn;
    for (; end < draws.size() && &parts[lit.part[draws[end].pixel]] == &part; ++end)
      drawn.push_back(lit.pixels[draws[end].pixel]);
    PassSums anew(film_kernels_, drawn.size(), frame.lights.size());
    EquallySampled again = PartOf(gbuffer, std::move(drawn));
    again.density = part.density;
    again.first_pixel = static_cast<std::uint32_t>(relit_.drawn() - draws.size() + begin);
    for (int run = 0; run < relit_.runs(); ++run) {
      again.seed = relit_.Seed(run);
      anew.Clear();
      LightPart(again, {.pixel_sample = pixel_sample}, anew, own);
      for (std::size_t row = 0; row < sums.rows(); ++row) {
        const std::vector<float> values = anew.Luminances(row);
        luminance[row][run].insert(luminance[row][run].end(), values.begin(), values.end());
      }
    }
  }
  frame.times.relighting_s += own.lighting_s;
  relit_.Add(draws, luminance[0]);
  const double shrinks = std::pow(options_.antialias, 2);  // the variance of a mean
  for (std::size_t l = 0; l < frame.lights.size(); ++l)
    frame.lights[l].mean_variance += RelitPixels::Variance(draws, luminance[1 + l]) / shrinks;
}

void Renderer::ScaleGroups(Frame& frame) const {
  if (frame.groups.empty()) return;
  const auto pixels = static_cast<double>(frame.coverage.plane_size());
  std::vector<double> measured(frame.groups.size(), 0.0);
  for (std::size_t l = 0; l < group_of_.size(); ++l)
    measured[group_of_[l]] += pixels * frame.lights[l].mean_variance;
  std::fill(frame.variance.data.begin(), frame.variance.data.end(), 0.0f);
  for (std::size_t g = 0; g < frame.groups.size(); ++g) {
    core::Image& variance = frame.groups[g].variance;
    const double stated = SumOf(variance);
    for (std::size_t i = 0; i < variance.data.size() && stated > 0; ++i) {
      variance.data[i] = static_cast<float>(variance.data[i] * (measured[g] / stated));
      frame.variance.data[i] += variance.data[i];
    }
  }
  if (const double stated = SumOf(frame.stated_variance); stated > 0)
    frame.variance_scale = SumOf(frame.variance) / stated;
}

}  // namespace luxfield::render
