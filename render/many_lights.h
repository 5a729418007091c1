// Lights points with several lights of which each point draws some, so that its samples are as many
// as were asked for however many lights there are (docs/theory.md 6).
//
//   L = sum over the lights that are drawn of   L_l(n_l) / min(nbar_l, 1),   sum n_l <= K
//
// n_l of K samples of light l, nbar_l their expectation, which kernels/lights/select_lights.cl takes
// from a tree over the lights. Unbiased where the estimators are; n_l add up to K but for samples
// that the tree deals to a node none of whose lights reaches the point, and 0 where no light does.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/film/band_film.h"
#include "luxfield/render/film/frame.h"
#include "luxfield/render/kernels/sample/light_task_types.clh"
#include "luxfield/render/lights/light_tree.h"

namespace luxfield::render {

// A light to draw.
struct DrawnLight {
  LightSource source;
  core::Rgb scale = {1, 1, 1};     // of its channels
  std::size_t number = 0;          // of the picture's lights, and of its random streams
  std::size_t group = 0;           // of the film's
  Estimator* estimator = nullptr;  // that takes tasks
  Visibility visibility{};
  BoundedLight bounds{};
};

class ManyLights {
 public:
  // `tables` are those that bounds of luminaires name.
  ManyLights(FilmKernels& film_kernels, std::vector<DrawnLight> lights,
             std::span<const BoundedTable> tables);

  // Adds to `sums` what K = options.samples_per_pixel samples of each point of `part` find, in part
  // after part of the points, which bounds the memory. options.stream is that of light number 0.
  // `groups` and `passes` as PassSums has them. A point's result does not depend on the other points.
  void Light(const FilmPart& part, const EstimatorOptions& options, PassSums& sums,
             std::span<FilmLight> groups, int passes, RenderTimes& times);

 private:
  // Lights that one launch can light with.
  struct Launch {
    Estimator* estimator = nullptr;
    Visibility visibility{};
    std::vector<LightSource> sources;
  };
  struct Place {
    std::size_t launch = 0;
    int index = 0;  // in it
  };
  // What points [first, first + starts.size() - 1) drew, and the order in which it is lit.
  struct Drawn {
    std::size_t first = 0;
    std::vector<cl_int> starts;  // of each point's draws
    std::vector<LitDraw> draws;
    // One after the other, those of a launch together: launch l has [begins[l], begins[l + 1]).
    std::vector<std::size_t> points;
    std::vector<LightTask> tasks;
    std::vector<std::size_t> begins;
  };

  void Sort();
  Drawn Draw(const GBuffer& gbuffer, const EstimatorOptions& options, std::size_t first,
             std::size_t end);
  void LightDrawn(const FilmPart& part, const Drawn& drawn, const EstimatorOptions& options,
                  PassSums& sums, std::span<FilmLight> groups, int passes);

  FilmKernels& film_kernels_;
  std::vector<DrawnLight> lights_;
  std::vector<Launch> launches_;
  std::vector<Place> places_;       // of each light
  std::vector<std::size_t> order_;  // lights by launch
  LightTree tree_;
  Kernel select_;
};

}  // namespace luxfield::render
