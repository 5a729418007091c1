// What a merge shows of the causes of errors, carried to quantities Q = sum w E; see
// error_budget.h.
#pragma once

#include <array>
#include <complex>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "luxfield/reconstruct/bracket/register_images.h"
#include "luxfield/reconstruct/bracket/session_plan.h"
#include "luxfield/reconstruct/budget/error_budget.h"
#include "luxfield/reconstruct/budget/print_sensitivity.h"
#include "luxfield/reconstruct/budget/stage_sensitivity.h"

namespace luxfield::reconstruct {

// Everything a propagation starts from; all must outlive it.
struct PropagationInput {
  const session::SessionReader& session;
  const SessionPlan& plan;  // the sensor's calibration applied
  const MergeSessionOptions& how;
  const lightfield::Measurements& measurements;
  const lightfield::LightField& coefficients;
};

class ErrorPropagation : public MergeObserver {
 public:
  // `weights`: w of every quantity (AdjointSolve).
  ErrorPropagation(const PropagationInput& input, std::vector<lightfield::Weights> weights);

  void OnReferences(std::span<const MergedReference> references, const LampDrift& drift) override;
  void OnExposures(const SessionExposures& exposures) override { exposures_ = exposures; }
  void OnBracket(const MergedBracket& bracket) override;

  // Standard deviations of quantity q; kMeter, kGeometry and kFilterNoise stay absent. To be asked
  // after the merge.
  std::array<std::optional<double>, kErrorSources> Sigma(std::size_t q,
                                                         const ErrorSizes& sizes) const;

 private:
  // A reference frame: what remains of it when the merge is over.
  struct Reference {
    const session::FrameRecord* record = nullptr;
    std::vector<std::size_t> pixels;
    double signal_dn = 0, factor = 1;
    int darks = 0;
    std::size_t first = 0;  // index of its series' first
    double monitor_share = 0;
    lightfield::Vec2 log_signal_per_m;
  };
  using FrameLights =
      std::map<const session::FrameRecord*, double>;  // dQ per relative error of each
  // dQ per metre by which all images are registered beside their place, towards +s, -s, +t and -t:
  // where texels end on edges of pixels, the way back costs more or less than the way there. Exact
  // for these frames, whose noise and pixels of unequal sensitivity are resampled as well.
  using RegistrationSlopes = std::array<double, 4>;
  struct Sums {
    lightfield::Weights weights;
    double photon_variance = 0, read_variance = 0;
    std::map<double, std::vector<double>> dark;  // by exposure time: dQ per DN of the mean dark
    std::vector<double> pixel;                   // dQ per relative sensitivity
    FrameLights light;                           // with exposure times as they are taken
    double stray = 0;                            // dQ per share
    std::vector<LagSums> lags;
    RegistrationSlopes registration{};
    std::vector<ImageSlope> position;  // of the whole rig
  };
  // Pixels whose mean over each texel is (a share of) a channel's image.
  struct Seen {
    int channel = 0;
    double share = 1;
    std::vector<std::vector<PixelShare>> overlaps;
  };
  // For the filter centred on centre_m. A colour mosaic's bracket shows all channels, green by two
  // sites.
  std::vector<Seen> SeenBy(const MergedBracket& bracket, lightfield::Vec2 centre_m) const;
  // dQ per electron per second of every pixel.
  void AddRates(const Sums& sums, const MergedBracket& bracket, const std::vector<Seen>& seen,
                std::vector<double>* by_rate) const;
  void AddRegistrationSlopes(const MergedBracket& bracket, const std::vector<Seen>& all);

  // dQ per relative error of every reference's sum and every reference's monitor reading.
  struct ReferenceTerms {
    std::vector<double> signal, meter;
  };

  ReferenceTerms Terms(const FrameLights& lights) const;
  double ReadVariance(const Sums& sums, const ReferenceTerms& terms) const;
  double ShutterVariance(const FrameLights& lights, const ReferenceTerms& terms) const;
  double ExposureTimesVariance(const FrameLights& lights, const ReferenceTerms& terms) const;
  double DriftVariance(const FrameLights& lights, const ReferenceTerms& terms,
                       double period_s) const;
  double ImageShiftVariance(const Sums& sums) const;  // per m^2 on each axis
  double StageVariance(const Sums& sums, const ReferenceTerms& terms) const;
  double own_variance_dn2(double exposure_s) const;

  PropagationInput input_;
  PrintSensitivity print_;
  std::vector<double> print_factors_;
  std::vector<Sums> sums_;
  std::vector<Reference> references_;
  LampDrift drift_;
  std::optional<SessionExposures> exposures_;         // none: as read back
  std::map<const session::FrameRecord*, int> visit_;  // arrivals of the stage
};

}  // namespace luxfield::reconstruct
