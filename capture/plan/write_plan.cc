#include "luxfield/capture/plan/write_plan.h"

#include <fmt/format.h>

#include <string>

#include "luxfield/core/file.h"

namespace luxfield::capture {
namespace {

std::string Quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

}  // namespace

void WritePlan(const std::filesystem::path& path, const Plan& plan) {
  const auto& geometry = plan.geometry;
  const auto& grid = geometry.grid;
  const auto& l = geometry.lattice;
  const auto centred =
      lightfield::BasisGrid::Centred(grid.basis, grid.width, grid.height, grid.spacing_m);
  const bool reflector = plan.rig == rig::RigKind::kReflector;
  std::string text = fmt::format(
      "[plan]\nname = {}\nunit = \"{}\"\nchannels = {}\norder = \"{}\"\norder_seed = {}\n"
      "dark_repeats = {}\n",
      Quoted(plan.name), lightfield::FluxUnitName(geometry.unit), geometry.channels,
      plan.order == Order::kRandom ? "random" : "serpentine", plan.order_seed, plan.dark_repeats);
  text += fmt::format("\n[rig]\nkind = \"{}\"\ndelta_m = {}\n", rig::RigKindName(plan.rig),
                      geometry.delta_m);
  if (reflector) text += fmt::format("albedo = {}\n", plan.albedo);
  text += fmt::format("\n[filter]\nkind = \"{}\"\nbasis = \"{}\"\n", plan.dual ? "dual" : "basis",
                      grid.basis.name());
  if (grid.basis.kind == lightfield::BasisKind::kQuadratic)
    text += fmt::format("basis_a = {}\n", grid.basis.a);
  text += fmt::format("spacing_m = {}\n", grid.spacing_m);
  if (!plan.dual) text += fmt::format("scale = {}\n", plan.filter_scale);
  text += fmt::format("\n[grid]\nwidth = {}\nheight = {}\ncentre_u_m = {}\ncentre_v_m = {}\n",
                      grid.width, grid.height, grid.u0_m - centred.u0_m, grid.v0_m - centred.v0_m);
  text += fmt::format(
      "\n[lattice]\nwidth = {}\nheight = {}\nds_m = {}\ndt_m = {}\ncentre_s_m = {}\n"
      "centre_t_m = {}\n",
      l.width, l.height, l.ds_m, l.dt_m, l.s0_m + 0.5 * l.extent_s_m(),
      l.t1_m - 0.5 * l.extent_t_m());
  const ExposurePolicy& e = plan.exposure;
  text += fmt::format(
      "\n[exposure]\nmin_s = {}\nmax_s = {}\nratio = {}\npwm_hz = {}\nsaturation_share = {}\n"
      "relevant_share = {}\nfloor_sigmas = {}\nrepeats = {}\nmax_attempts = {}\n"
      "mean_tolerance = {}\nflicker = {}\n",
      e.min_s, e.max_s, e.ratio, e.measure_pwm ? "\"measure\"" : fmt::format("{}", e.pwm_hz),
      e.saturation_share, e.relevant_share, e.floor_sigmas, e.repeats, e.max_attempts,
      e.mean_tolerance, e.flicker);
  const ReferencePolicy& r = plan.reference;
  text += fmt::format(
      "\n[reference]\nevery = {}\nmax_drift = {}\nresume_share = {}\ninterval_s = {}\n"
      "max_wait_s = {}\n",
      r.every, r.max_drift, r.resume_share, r.interval_s, r.max_wait_s);
  const WarmUpPolicy& w = plan.warm_up;
  text +=
      fmt::format("\n[warm_up]\nwindow_s = {}\ninterval_s = {}\nvariation = {}\nmax_wait_s = {}\n",
                  w.window_s, w.interval_s, w.variation, w.max_wait_s);
  const hal::StageBounds& s = plan.stage;
  if (s.min || s.max || s.speed_m_per_s) text += "\n[stage]\n";
  if (s.min) text += fmt::format("min_m = [{}, {}]\n", s.min->x, s.min->y);
  if (s.max) text += fmt::format("max_m = [{}, {}]\n", s.max->x, s.max->y);
  if (s.speed_m_per_s) text += fmt::format("speed_m_per_s = {}\n", *s.speed_m_per_s);
  core::WriteFileAtomically(path, text);
}

}  // namespace luxfield::capture
