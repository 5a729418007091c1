#include "luxfield/view/documents/session_document.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cfloat>
#include <chrono>

#include "luxfield/core/printable.h"
#include "luxfield/core/progress.h"
#include "luxfield/view/documents/failed_document.h"
#include "luxfield/view/documents/last_frame_panel.h"
#include "luxfield/view/session/session_watch.h"

namespace luxfield::view {
namespace {

constexpr double kPoll_s = 0.5;

// The colours of Okabe and Ito (2008), which eyes of every kind tell apart.
struct StateLook {
  PositionState state;
  const char* name;
  ImU32 colour;
};
constexpr StateLook kStates[] = {
    {PositionState::kWaiting, "waiting", IM_COL32(70, 70, 74, 255)},
    {PositionState::kExposing, "exposing", IM_COL32(240, 228, 66, 255)},
    {PositionState::kDone, "done", IM_COL32(0, 114, 178, 255)},
    {PositionState::kFlagged, "done, a frame flagged", IM_COL32(230, 159, 0, 255)},
};
constexpr ImU32 kRetaken =
    IM_COL32(213, 94, 0, 255);  // a corner of positions with frames taken again

const StateLook& LookOf(PositionState state) {
  return *std::ranges::find(kStates, state, &StateLook::state);
}

void DrawKey(const char* name, ImU32 colour, int count) {
  const float size = ImGui::GetTextLineHeight();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImGui::GetWindowDrawList()->AddRectFilled(at, ImVec2(at.x + size, at.y + size), colour);
  ImGui::Dummy(ImVec2(size, size));
  ImGui::SameLine();
  ImGui::Text("%s: %d", name, count);
}

void DrawSeries(const char* name, const std::vector<WatchedValue>& series, const char* format) {
  if (series.size() < 2) return;
  std::vector<float> values;
  for (const WatchedValue& value : series) values.push_back(static_cast<float>(value.value));
  const auto [least, most] = std::ranges::minmax(values);
  const std::string label =
      fmt::format("{}:\n{} to {}", name, fmt::format(fmt::runtime(format), least),
                  fmt::format(fmt::runtime(format), most));
  ImGui::TextUnformatted(label.c_str());
  ImGui::PlotLines((std::string("##") + name).c_str(), values.data(),
                   static_cast<int>(values.size()), 0, nullptr, FLT_MAX, FLT_MAX,
                   ImVec2(ImGui::GetContentRegionAvail().x, 3 * ImGui::GetFontSize()));
}

class SessionDocument : public Document {
 public:
  SessionDocument(std::filesystem::path folder, bool wait)
      : folder_(std::move(folder)), last_frame_(folder_) {
    if (!wait) watch_.emplace(folder_);
  }

  void Update() override {
    if (watch_ && watch_->session().last_frame) last_frame_.Follow(*watch_->session().last_frame);
    const auto now = std::chrono::steady_clock::now();
    if (failure_ || now - looked_ < std::chrono::duration<double>(kPoll_s)) return;
    looked_ = now;
    try {
      if (watch_)
        watch_->Update();
      else if (SessionWatch::IsThere(folder_))
        watch_.emplace(folder_);
    } catch (const std::exception&) {
      failure_ = CurrentFailure();
    }
  }

  bool DrawsItself() const override { return true; }
  double PollingInterval() const override { return kPoll_s; }
  std::optional<Failure> failure() const override { return failure_; }

  // Until there is a session, and its last frame.
  bool Settled() const override { return (watch_ && last_frame_.ready()) || failure_; }

  std::string Status() const override {
    if (!watch_) return "waiting";
    const WatchedSession& session = watch_->session();
    if (session.sealed) return "sealed";
    std::string state = session.suspended ? "suspended: the lamp drifts"
                        : session.paused  ? "paused"
                                          : "open";
    if (session.eta_s) state += fmt::format(", {} left", core::FormatDuration(*session.eta_s));
    return state + "; last line " + core::OnOneLine(session.utc);
  }

  void DrawMain() override {
    if (failure_) return DrawSentence("This cannot be shown", failure_->sentence);
    if (!watch_)
      return DrawSentence(folder_.filename().string(), "Waiting for the capture to begin ...");
    const WatchedSession& session = watch_->session();
    if (session.positions.empty()) {
      ImGui::Text(
          "A session of a plan of kind \"%s\" has no filter positions; %d frames are there.",
          session::PlanKindName(session.kind).c_str(), session.frames);
      return;
    }
    DrawMap(session);
  }

  void DrawPanel() override {
    if (!watch_) return;
    const WatchedSession& session = watch_->session();
    if (ImGui::CollapsingHeader("Session", ImGuiTreeNodeFlags_DefaultOpen)) {
      ImGui::TextWrapped("%s, a plan of kind %s", core::OnOneLine(session.name).c_str(),
                         session::PlanKindName(session.kind).c_str());
      if (!session.positions.empty()) {
        for (const StateLook& look : kStates)
          DrawKey(look.name, look.colour, session.Count(look.state));
        const auto retaken = std::ranges::count_if(session.positions, [](const auto& position) {
          return position.retake || position.rejected > 0;
        });
        DrawKey("corner: frames taken again", kRetaken, static_cast<int>(retaken));
      }
      ImGui::Text("%d frames, %d flagged, %d rejected", session.frames, session.flagged,
                  session.rejected);
      ImGui::Text("%d start%s", session.epochs, session.epochs == 1 ? "" : "s");
    }
    if (session.last_frame) last_frame_.Draw(*session.last_frame);
    if (ImGui::CollapsingHeader("Over time", ImGuiTreeNodeFlags_DefaultOpen)) {
      DrawSeries("lamp over its first reference", session.drift, "{:.4f}");
      DrawSeries("sensor in degrees C", session.temperature_c, "{:.1f}");
      if (session.drift.size() < 2 && session.temperature_c.size() < 2)
        ImGui::TextDisabled("nothing measured yet");
    }
  }

 private:
  // A square for each position: i to the right, j upwards, as a viewer from behind the filter plane
  // has u and v.
  static void DrawMap(const WatchedSession& session) {
    int i0 = session.positions[0].i, i1 = i0, j0 = session.positions[0].j, j1 = j0;
    for (const WatchedPosition& position : session.positions) {
      i0 = std::min(i0, position.i);
      i1 = std::max(i1, position.i);
      j0 = std::min(j0, position.j);
      j1 = std::max(j1, position.j);
    }
    const ImVec2 at = ImGui::GetCursorScreenPos(), room = ImGui::GetContentRegionAvail();
    const float cell = 0.9f * std::min(room.x / static_cast<float>(i1 - i0 + 1),
                                       room.y / static_cast<float>(j1 - j0 + 1));
    const float left = at.x + 0.5f * (room.x - cell * static_cast<float>(i1 - i0 + 1));
    const float bottom = at.y + 0.5f * (room.y + cell * static_cast<float>(j1 - j0 + 1));
    const float gap = std::min(2.0f, 0.1f * cell);
    ImDrawList* list = ImGui::GetWindowDrawList();
    for (const WatchedPosition& position : session.positions) {
      const ImVec2 from(left + cell * static_cast<float>(position.i - i0),
                        bottom - cell * static_cast<float>(position.j - j0 + 1));
      const ImVec2 to(from.x + cell - gap, from.y + cell - gap);
      const StateLook& look = LookOf(position.state);
      list->AddRectFilled(from, to, look.colour);
      if (position.retake || position.rejected > 0)
        list->AddTriangleFilled(ImVec2(to.x - 0.35f * cell, from.y), ImVec2(to.x, from.y),
                                ImVec2(to.x, from.y + 0.35f * cell), kRetaken);
      if (ImGui::IsMouseHoveringRect(from, to))
        ImGui::SetTooltip("i %d, j %d: %s%s; %d frames rejected", position.i, position.j, look.name,
                          position.retake ? ", to be taken again" : "", position.rejected);
    }
  }

  const std::filesystem::path folder_;
  std::optional<SessionWatch> watch_;  // empty: waiting for it
  LastFramePanel last_frame_;
  std::chrono::steady_clock::time_point looked_{};
  std::optional<Failure> failure_;
};

}  // namespace

std::unique_ptr<Document> OpenSession(const std::filesystem::path& folder, bool wait) {
  return std::make_unique<SessionDocument>(folder, wait);
}

}  // namespace luxfield::view
