#include "luxfield/cli/verbs/certificate_set_up.h"

#include <fmt/format.h>

#include <filesystem>

#include "luxfield/core/file.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/session_file.h"

namespace luxfield::cli {
namespace {

using Rows = std::vector<std::pair<std::string, std::string>>;

void AddPlan(Rows* rows, const session::PlanFile& plan) {
  rows->push_back({"plan", plan.name});
  if (!plan.geometry) return;
  const auto& g = *plan.geometry;
  rows->push_back({"planes", fmt::format("{:.6g} m apart", g.delta_m)});
  rows->push_back(
      {"filter", fmt::format("{} x {} positions of {}, {:.6g} mm apart", g.grid.width,
                             g.grid.height, g.grid.basis.name(), 1e3 * g.grid.spacing_m)});
  rows->push_back(
      {"image plane", fmt::format("{} x {} texels of {:.4g} mm x {:.4g} mm, {}", g.lattice.width,
                                  g.lattice.height, 1e3 * g.lattice.ds_m, 1e3 * g.lattice.dt_m,
                                  g.channels == 1 ? "luminance" : "three channels")});
}

void AddCamera(Rows* rows, const session::SessionCamera& camera) {
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  if (camera.width && camera.height) add(fmt::format("{} x {}", *camera.width, *camera.height));
  if (camera.bits) add(fmt::format("{} bits", *camera.bits));
  if (camera.gain_dn_per_e) add(fmt::format("{:.4g} DN per electron", *camera.gain_dn_per_e));
  if (camera.read_noise_dn) add(fmt::format("read noise {:.3g} DN", *camera.read_noise_dn));
  if (camera.prnu) add(fmt::format("PRNU {:.2g}", *camera.prnu));
  if (!camera.cfa.empty()) add("mosaic " + camera.cfa);
  if (!text.empty()) rows->push_back({"camera", text});
}

// When its first and its last record were written.
void AddTimes(Rows* rows, const session::SessionReader& session) {
  std::string first, last;
  for (const auto& record : session.journal())
    if (const auto utc = record.find("utc"); utc != record.end() && utc->is_string()) {
      if (first.empty()) first = utc->get<std::string>();
      last = utc->get<std::string>();
    }
  if (!first.empty()) rows->push_back({"taken (UTC)", first + " to " + last});
}

}  // namespace

Rows SetUpOf(const session::SessionReader& session) {
  Rows rows;
  AddPlan(&rows, PlanOf(session));
  AddTimes(&rows, session);
  rows.push_back({"frames", fmt::format("{}{}", session.frames().size(),
                                        session.sealed() ? ", sealed" : ", not sealed")});
  const session::SessionSetup setup = SetupOf(session);
  for (const auto& [role, identity] : setup.devices) rows.push_back({role, identity});
  if (setup.camera) AddCamera(&rows, *setup.camera);
  for (const auto& [name, version] : setup.software)
    rows.push_back({"program of the capture", name + " " + version});
  for (const auto& [field, sha256] : setup.lab_files)
    rows.push_back({"file of the lab, " + field, "SHA-256 " + sha256});
  return rows;
}

std::vector<HashedFile> FilesOf(const session::SessionReader& session) {
  std::vector<HashedFile> files;
  for (const auto& [role, name] : {std::pair{"plan", "plan.json"},
                                   {"devices", "session.json"},
                                   {"journal", "journal.jsonl"},
                                   {"manifest of all frames", "manifest.json"}}) {
    const auto path = session.folder() / name;
    if (std::filesystem::exists(path))
      files.push_back({role, path.filename().string(), core::Sha256OfFile(path)});
  }
  return files;
}

}  // namespace luxfield::cli
