// Every quantity that a page of photometry states, over simulated labs that measure one lamp with
// noise: its standard uncertainty is the scatter of what the labs state, and its 95 % interval holds
// the truth in 95 % of them. LUXFIELD_LABS=400 is the proof.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "luxfield/photometry/answers.h"
#include "luxfield/photometry/beyond_planes.h"
#include "luxfield/photometry/colour.h"
#include "luxfield/photometry/comparison.h"
#include "luxfield/photometry/dose.h"
#include "tests/photometry/labs.h"
#include "tests/photometry/lamps.h"
#include "tests/seed.h"

namespace luxfield::photometry {
namespace {

using lightfield::LightField;
using lightfield::PosedLightField;
using lightfield::Vec3;

void Put(Quantities& out, const std::string& name, const std::optional<Estimate>& one) {
  if (one) out[name] = *one;
}

void PutAngle(Quantities& out, const std::string& name, const BeamAngle& angle) {
  out[name + ", C0"] = angle.along_c0_deg;
  out[name + ", C90"] = angle.along_c90_deg;
  out[name] = angle.mean_deg;
}

void PutDistances(Quantities& out, const std::string& name, const InverseSquare& found) {
  for (std::size_t k = 0; k < found.distance_m.size(); ++k)
    Put(out, name + " " + std::to_string(kInverseSquarePercent[k]) + " %", found.distance_m[k]);
}

void PutPoint(Quantities& out, const Lamp& lamp) {
  PointAsked asked;
  asked.p_m = {0.2, -0.1, 0.9};
  asked.normal = Normalized(Vec3{-0.2, 0.1, -1});
  asked.axis = {0, 0, 1};
  asked.facing = Vec3{-1, 0, 0};
  const PointAnswer answer = AnswerAt(lamp, asked);
  out["illuminance"] = answer.illuminance;
  out["spherical"] = answer.spherical;
  out["cylindrical"] = answer.cylindrical;
  Put(out, "semicylindrical", answer.semicylindrical);
  for (int k = 0; k < 3; ++k)
    out["light vector " + std::to_string(k)] = answer.light_vector[std::size_t(k)];
}

void PutPlane(Quantities& out, const Lamp& lamp) {
  const PlaneAnswer answer = AnswerOn(lamp, PlaneBefore(1.2, 0.6, 0.4, 6, 5));
  out["plane, mean"] = answer.mean;
  out["plane, smallest"] = answer.least;
  out["plane, largest"] = answer.most;
  Put(out, "uniformity", answer.uniformity);
  Put(out, "diversity", answer.diversity);
}

void PutReceivers(Quantities& out, const Lamp& lamp) {
  for (const auto& [name, shape] : {std::pair{"spheres", ReceiverShape::kSphere},
                                    {"cylinders", ReceiverShape::kCylinder},
                                    {"semicylinders", ReceiverShape::kSemicylinder}}) {
    PlaneAsked plane = PlaneBefore(1.1, 0.6, 0.4, 3, 2);
    plane.receiver = {.shape = shape, .axis = {0, 1, 0}, .facing = {0, 0, -1}};
    const PlaneAnswer answer = AnswerOn(lamp, plane);
    out[std::string("plane of ") + name + ", mean"] = answer.mean;
    out[std::string("plane of ") + name + ", largest"] = answer.most;
    Put(out, std::string("uniformity of ") + name, answer.uniformity);
  }
  LineAsked line;
  line.from_m = {-0.3, 0, 0.7};
  line.to_m = {0.2, 0.2, 1.4};
  line.points = 3;
  line.axis = {0, 1, 0};
  const LineAnswer answer = AnswerAlong(lamp, line);
  for (int k = 0; k < line.points; ++k) {
    const PointAnswer& point = answer.points[std::size_t(k)];
    out["along a line " + std::to_string(k)] = point.illuminance;
    out["spheres along a line " + std::to_string(k)] = point.spherical;
  }
}

void PutMoved(Quantities& out, const Lamp& lamp) {
  VolumeAsked volume;
  volume.middle = PlaneBefore(1, 0.5, 0.5, 3, 2);
  volume.middle.receiver.shape = ReceiverShape::kSphere;
  volume.depth_m = 0.4;
  volume.layers = 2;
  const VolumeAnswer in = AnswerIn(lamp, volume);
  out["volume, mean"] = in.mean;
  out["volume, smallest"] = in.least;
  out["volume, largest"] = in.most;
  PathAsked path;
  path.times_s = {0, 3};
  path.positions_m = {{-0.2, 0, 0.8}, {0.3, 0.1, 0.9}};
  const DoseAnswer dose = DoseAlong(lamp, path);
  out["dose"] = dose.dose;
  out["dose over time"] = dose.mean;
  out["dose, largest rate"] = dose.most;
}

void PutEye(Quantities& out, const Lamp& lamp) {
  EyeAsked asked;
  asked.eye_m = {0.1, -0.05, 1.1};
  asked.fields_of_view_mrad = {11, 100};
  asked.threshold = 10;  // all of the lamp is brighter, in every lab
  asked.line_of_sight = Normalized(Vec3{0.1, 0, -1});
  asked.up = Normalized(Vec3{0, 1, 0});
  asked.age_years = 40;
  asked.background = 40;
  asked.road_luminance = 1;
  const EyeAnswer answer = AnswerFor(lamp, asked);
  for (const auto& field : answer.fields)
    out["luminance over " + std::to_string(int(field.mrad)) + " mrad"] = field.largest;
  out["peak luminance"] = answer.fields.back().peak;
  if (answer.area) out["luminance of the luminous area"] = answer.area->luminance;
  Put(out, "UGR", answer.ugr);
  Put(out, "veiling luminance", answer.veiling);
  Put(out, "threshold increment", answer.threshold_increment);
}

// Of a threshold that a part of the lamp is above.
void PutLuminousArea(Quantities& out, const Lamp& lamp) {
  EyeAsked asked;
  asked.eye_m = {0.02, -0.12, 0.7};
  asked.threshold = 9000;
  asked.line_of_sight = Normalized(Vec3{-0.3, 0.2, -1});
  asked.up = Normalized(Vec3{0, 1, 0});
  asked.background = 40;
  const EyeAnswer answer = AnswerFor(lamp, asked);
  out["solid angle of a part"] = answer.area->solid_angle;
  out["projected area of a part"] = answer.area->projected_m2;
  out["luminance of a part"] = answer.area->luminance;
  Put(out, "UGR of a part", answer.ugr);
}

void PutPeakDirection(Quantities& out, const Distribution& d) {
  const Direction at = DirectionOf(d.peak_direction);
  out["peak, C"] = {at.c_deg, d.peak_direction_u->c_deg};
  out["peak, gamma"] = {at.gamma_deg, d.peak_direction_u->gamma_deg};
}

Quantities AllOf(const Lamp& lamp) {
  Quantities out;
  const Distribution d = DistributionOf(lamp);
  out["flux"] = d.flux;
  out["intensity, axis"] = d.axis;
  out["intensity, peak"] = d.peak;
  PutAngle(out, "beam angle", *d.beam);
  PutAngle(out, "field angle", *d.field);
  PutDistances(out, "inverse square on the axis", d.on_axis);
  PutDistances(out, "inverse square towards the peak", d.towards_peak);
  PutPeakDirection(out, d);
  // About C90-C270 this lamp is nearly its own mirror image, and noise is most of what is not.
  Put(out, "asymmetry about C0-C180", d.asymmetry_c0_c180);
  PutPoint(out, lamp);
  PutPlane(out, lamp);
  PutReceivers(out, lamp);
  PutMoved(out, lamp);
  PutEye(out, lamp);
  PutLuminousArea(out, lamp);
  return out;
}

// What channels that are weighed are asked for.
Quantities Received(const Lamp& lamp) {
  Quantities out;
  PutPoint(out, lamp);
  PutPlane(out, lamp);
  PutReceivers(out, lamp);
  PutMoved(out, lamp);
  return out;
}

void PutColour(Quantities& out, const std::string& name, const std::optional<Colour>& colour) {
  out[name + " x"] = colour->x;
  out[name + " y"] = colour->y;
  out[name + " u'"] = colour->u;
  out[name + " v'"] = colour->v;
  Put(out, name + " CCT", colour->kelvin);
  Put(out, name + " Duv", colour->duv);
}

Quantities AllOf(const ColourLamp& lamp) {
  Quantities out;
  PutColour(out, "mean", ColourOf(lamp, FluxOf(lamp.channels[0])));
  PutColour(out, "axis", ColourOf(lamp, IntensityTowards(lamp.channels[0], {0, 0, 1})));
  PutColour(out, "aside", ColourOf(lamp, IntensityTowards(lamp.channels[0], {0.1, -0.1, 1})));
  const IntensityTable table = TableOf(lamp.channels[1], 45, 4);
  Put(out, "rms colour difference", ColourDistributionOf(lamp, table, {0, 0, 1}).rms_deviation);
  return out;
}

// of(lamp_of(a field)) are the quantities that a lab states.
template <typename LampOf, typename Of>
void ExpectLabsAreHonest(const NoisyField& noisy, std::uint64_t stream, LampOf&& lamp_of, Of&& of) {
  const int labs = LabsOr(40);
  LabsJudge judge(of(lamp_of(noisy.field())));
  core::Random random(TestSeed(20261129), stream);
  for (int lab = 0; lab < labs; ++lab) judge.Add(of(lamp_of(noisy.Draw(random))));
  judge.ExpectHonest();
}

// A lamp with a peak, and light everywhere, so that all of it is brighter than a threshold.
LightField Lit(int channels) {
  LightField field = SmoothField(channels);
  for (float& c : field.data) c += 2e4f;
  return field;
}

TEST(Labs, StateWhatTheyScatter) {
  const NoisyField noisy(Lit(1), PlainMaps(SmoothField().geometry.grid), 0.002);
  const std::vector<PosedLightField> sigma = {{"", {}, noisy.SigmaOfC()}};
  const std::vector<SolveMaps> maps = {noisy.maps()};
  ExpectLabsAreHonest(
      noisy, 1,
      [&](const LightField& field) {
        Lamp lamp = LampOfField(field);
        SetNoise(lamp, sigma, maps, "sigma");
        return lamp;
      },
      [](const Lamp& lamp) { return AllOf(lamp); });
}

// Of two channels, one of which counts as less.
TEST(Labs, StateWeighedChannelsAsTheyScatter) {
  const NoisyField noisy(Lit(2), PlainMaps(SmoothField().geometry.grid), 0.002);
  const std::vector<PosedLightField> sigma = {{"", {}, noisy.SigmaOfC()}};
  const std::vector<SolveMaps> maps = {noisy.maps()};
  ExpectLabsAreHonest(
      noisy, 3,
      [&](const LightField& field) {
        const std::vector<PosedLightField> fields = {{"", {}, field}};
        Lamp lamp = LampOf(fields, std::array{4.6, -0.7}, "");
        SetNoise(lamp, sigma, maps, "sigma");
        return lamp;
      },
      Received);
}

// Noise at the border makes the bound larger, never smaller than by chance.
TEST(Labs, NoiseMakesTheBoundBeyondThePlanesLarger) {
  const int labs = LabsOr(40);
  const NoisyField noisy(Lit(1), PlainMaps(SmoothField().geometry.grid), 0.002);
  const double truth = FluxBeyondPlanesBound(LampOfField(noisy.field()));
  core::Random random(TestSeed(20261129), 4);
  double sum = 0, squares = 0;
  for (int lab = 0; lab < labs; ++lab) {
    const double more = FluxBeyondPlanesBound(LampOfField(noisy.Draw(random))) - truth;
    sum += more;
    squares += more * more;
  }
  const double mean = sum / labs, variance = (squares - labs * mean * mean) / (labs - 1);
  EXPECT_GT(mean, -4.5 * std::sqrt(variance / labs));
}

TEST(Labs, StateColoursAsTheyScatter) {
  const NoisyField noisy(Lit(3), PlainMaps(SmoothField().geometry.grid), 0.002);
  const std::vector<PosedLightField> sigma = {{"", {}, noisy.SigmaOfC()}};
  const std::vector<SolveMaps> maps = {noisy.maps()};
  ExpectLabsAreHonest(
      noisy, 2,
      [&](const LightField& field) {
        const std::vector<PosedLightField> fields = {{"", {}, field}};
        return *ColourLampOf(fields, sigma, maps, "sigma");
      },
      [](const ColourLamp& lamp) { return AllOf(lamp); });
}

}  // namespace
}  // namespace luxfield::photometry
