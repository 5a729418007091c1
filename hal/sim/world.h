// The simulated lab as one coupled world: lamp -> print at the stage's pose -> image plane ->
// sensor, under one clock.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "luxfield/core/clock.h"
#include "luxfield/hal/sim/lab_description.h"
#include "luxfield/hal/sim/tracer.h"

namespace luxfield::hal::sim {

class World {
 public:
  explicit World(LabDescription lab);

  const LabDescription& lab() const { return lab_; }
  const Sensor& sensor() const { return sensor_; }
  const std::shared_ptr<core::SimulatedClock>& clock() const { return clock_; }

  // What is going to be visited, so that each ray is traced once for all of it.
  void Announce(const VisitPlan& plan);

  void SwitchLamp(bool on);
  bool lamp_on() const { return lamp_on_since_.has_value(); }
  void MoveStage(Vec2 setpoint);  // instantaneous; the stage's driver lets the time pass
  Vec2 stage_setpoint() const { return setpoint_; }

  bool shutter_open = true;
  int print = 0;
  int channel = 0;
  int target = 0;  // index into TargetPositions: a calibration target in place of lamp and print

  // Starts now; returns when the clock has passed the exposure. `frame_id` numbers the exposure.
  session::RawFrame Expose(double exposure_s, std::uint64_t frame_id);
  // Lamp output now, relative to the settled lamp, without PWM.
  double LampFactor() const;

 private:
  // The n-th arrival at a setpoint: what the stage's error depends on.
  struct Visit {
    std::int64_t u_nm = 0, v_nm = 0;
    int number = 0;
    auto operator<=>(const Visit&) const = default;
  };
  struct Traced {
    LatticeWindow window;
    std::vector<std::vector<float>> images;  // per print
  };

  Visit NextVisit(Vec2 setpoint, std::map<Visit, int>& counts) const;
  Vec2 ActualCentre(const Visit& visit) const;
  const Traced& Trace(const Visit& visit);
  void TraceBatch(const std::vector<Visit>& visits);
  std::size_t BytesPerVisit() const;
  // What each pixel sees at the present visit, print and channel; of a mosaic, in its own colour.
  const std::vector<float>& PixelIrradiance();
  void TakeMosaic();  // puts every pixel's own colour in place of the first traced one
  // Mean irradiance on I over each pixel, of one plane of the lamp's traced channels.
  std::vector<float> LightOf(int plane);
  std::vector<float> TargetIrradiance() const;
  void AddStrayLight(std::vector<float>& pixels) const;
  std::vector<float> Resample(const Traced& traced, Vec2 centre, int plane) const;

  LabDescription lab_;
  Sensor sensor_;
  FilterPrint print_model_;
  std::shared_ptr<core::SimulatedClock> clock_ = std::make_shared<core::SimulatedClock>();

  int epoch_ = 0;
  Vec2 setpoint_;
  Visit visit_;
  std::map<Visit, int> visit_counts_;  // by setpoint (number 0)
  std::vector<Visit> announced_;
  std::map<Visit, Traced> cache_;
  lightfield::Lattice lattice_;  // of the images in the cache
  std::optional<double> lamp_on_since_;

  struct PixelKey {
    Visit visit;
    int print = 0, plane = 0, target = 0;
    bool operator==(const PixelKey&) const = default;
  };
  std::optional<PixelKey> pixel_key_;
  std::vector<float> pixels_;
};

}  // namespace luxfield::hal::sim
