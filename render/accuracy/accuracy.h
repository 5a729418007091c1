// Pictures by what they are wanted for: an error, or a time, instead of an estimator and its knobs.
//
// The error is the relative RMSE of the picture's luminance: RMS of Y - Y_true over all pixels over
// the mean of Y_true (docs/theory.md 10). A small picture of the same view, the pilot, measures
// what the scene does to each estimator: the variance v(k) of a pass of k samples, from the spread
// of four, and its times, which correct the cost model (cost_model.h). The setting that is expected
// to meet the target soonest begins with a quarter of the picture's pixels (choose_setting.h), and
// goes on with the samples that each pixel lacks by what those around it show (further_round.h);
// the variance that the picture shows at pixels which are lit again (render/film/relit_pixels.h)
// decides whether more are needed. For a time asked for samples are dealt out by the small pilot
// (sample_density.h). A noise-free estimator states the error that it was measured to have.
//
// For an error asked for, times are processor time, so that the choice is the same on a busy
// machine.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/render/accuracy/cost_model.h"
#include "luxfield/render/renderer.h"

namespace luxfield::render {

struct AccuracyRequest {
  std::optional<double> rel_error;  // 0.005 for 0.5 %
  std::optional<double> time_s;     // wall time of lighting; exactly one of the two
  // Shadows, antialiasing, seed, size; estimator and samples are chosen.
  RenderOptions picture;
  std::vector<std::string> estimators;  // to choose from; empty: all that state their error
  // On the way to an error, for those who watch: a round that would take longer than this and than
  // twice the rounds before it aims at a larger error first. Empty: as few rounds as can be.
  std::optional<double> round_s;

  void Validate() const;  // throws InputError naming the field
};

// An estimator with its samples, and what is expected of it.
struct Setting {
  std::string estimator;
  int samples_per_pixel = 0;  // mean over the pixels; 0: takes none
  double predicted_s = 0, predicted_error = 0;
};

// Whether the first is to be preferred: it takes less time for an error asked for; of settings that
// keep a time asked for it errs less, and of those that do not it takes less time.
bool IsBetter(const AccuracyRequest& request, const Setting& a, const Setting& b);

struct AccurateFrame {
  Frame frame;
  Setting chosen;  // samples_per_pixel as the frame has them
  // Best setting of each estimator, cheapest first, without those that are clearly dearer than
  // another.
  std::vector<Setting> considered;
  double estimated_error = 0;  // of the frame
  bool met = false;            // the target, with the estimate's own uncertainty (2 sigma)
  double choosing_s = 0;       // wall time of pilots
  int rounds = 0;              // of samples, besides a pilot that is a part of the frame
  // Of luminaires: what that pilot and the first round lit, and the seconds as the cost model counts
  // them.
  LightingWork first_work;
  double first_s = 0;
};

// Whether an estimator takes light samples for a picture with shadows, or without.
bool TakesSamples(const EstimatorTraits& traits, bool shadows);

// Whether an error can be asked of an estimator on glossy or Lambertian surfaces: its samples are
// unbiased and show their variance, or it takes none and states a bound. `exact` stands for
// those that are the same as `exact` on Lambertian surfaces.
bool StatesItsError(const EstimatorTraits& traits, bool glossy, bool shadows);

// Whether the scene's luminaires may be lit by an estimator: it states its error there and is one
// of those that the request names; where it names none, any that is not there for comparison alone.
bool MayBeChosen(const EstimatorTraits& traits, const LitScene& scene,
                 const AccuracyRequest& request);

// Whether RenderToAccuracy reads the cost model: scenes of luminaires alone. What other lights cost
// pilots tell (render/accuracy/lights_accuracy.h).
bool ReadsCostModel(const LitScene& scene, const AccuracyRequest& request);

// Throws InputError for requests that cannot be served, without rendering anything: an estimator
// that does not state its error, glossy surfaces where none of the estimators takes them, samples
// of an environment that pixels share, as their errors are alike where margins take them as
// independent.
void RequireServable(const LitScene& scene, const AccuracyRequest& request);

// A picture on its way to what is asked of it, round by round.
//
//   const auto rendering = BeginRendering(scene, {.rel_error = 0.005, .round_s = 1.5});
//   while (!rendering->done()) {
//     rendering->TakeRound();
//     Show(rendering->result());
//   }
class AccurateRendering {
 public:
  virtual ~AccurateRendering() = default;
  // The first round chooses what to light with. Throws DeviceError, Interrupted: the result is then
  // that of the rounds before, and the next call takes the same round again.
  virtual void TakeRound() = 0;

  bool done() const { return done_; }  // no round follows
  // After a round.
  const AccurateFrame& result() const { return result_; }
  AccurateFrame TakeResult() { return std::move(result_); }

 protected:
  AccurateFrame result_;
  bool done_ = false;
};

// The scene outlives the rendering, and stays as it is. Throws what RequireServable does.
std::unique_ptr<AccurateRendering> BeginRendering(LitScene& scene, const CostModel& costs,
                                                  const AccuracyRequest& request);

// The same with the device's current cost model, which the picture refines for the next one.
std::unique_ptr<AccurateRendering> BeginRendering(LitScene& scene, const AccuracyRequest& request);

// All rounds of these. Throw what RequireServable does, DeviceError, Interrupted.
AccurateFrame RenderToAccuracy(LitScene& scene, const CostModel& costs,
                               const AccuracyRequest& request);
AccurateFrame RenderToAccuracy(LitScene& scene, const AccuracyRequest& request);

// Relative RMSE of the luminance of `picture` against `reference`, as above.
double LuminanceError(const core::Image& picture, const core::Image& reference);

}  // namespace luxfield::render
