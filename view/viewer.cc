#include "luxfield/view/viewer.h"

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/printable.h"
#include "luxfield/core/progress.h"
#include "luxfield/view/documents/open_input.h"
#include "luxfield/view/panels/help_panel.h"
#include "luxfield/view/panels/look_panel.h"
#include "luxfield/view/panels/picture_area.h"
#include "luxfield/view/panels/readings_panel.h"
#include "luxfield/view/panels/shown_picture.h"
#include "luxfield/view/window/keys.h"
#include "luxfield/view/window/screenshot.h"
#include "luxfield/view/window/window.h"

namespace luxfield::view {
namespace {

constexpr int kLeastFrames = 3;     // ImGui lays windows out in the first ones
constexpr double kBusy_s = 0.05;    // longest wait for an event while pictures come
constexpr double kActive_s = 0.01;  // while hands are at work, and for a while after
constexpr double kAfterwards_s = 0.4;
constexpr double kPanelWidth = 21;  // in heights of a letter
constexpr double kOneLine = 110;    // likewise: windows as wide have a last line that is only one
constexpr double kMiddleGrey = 0.18;
constexpr char kQuestion[] = "Not saved";
constexpr Key kFlying[] = {key::kW, key::kA, key::kS, key::kD, key::kE, key::kQ};

constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                                    ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                                    ImGuiWindowFlags_NoSavedSettings |
                                    ImGuiWindowFlags_NoBringToFrontOnFocus;

class Viewer {
 public:
  explicit Viewer(const ViewerOptions& options)
      : options_(options),
        window_(Title(false), options.size),
        document_(OpenInput(options.input, options.wait)),
        bare_(options.bare) {
    if (options.look) look_ = *options.look;
    if (!options.reference.empty()) reference_ = core::ReadExrImage(options.reference);
  }

  ViewerResult Run() {
    while (Goes()) {
      const bool drawn = window_.BeginFrame(Wait());
      document_->Update();
      window_.SetTitle(Title(document_->Settled()));
      if (drawn) Draw();
      KeepUnsaved();
      if (!drawn) continue;
      if (document_->picture() || document_->failure() || document_->DrawsItself()) ++frames_;
      if (!IsLastFrame()) {
        window_.EndFrame();
        continue;
      }
      WindowPixels pixels;
      window_.EndFrame(&pixels);
      WriteScreenshot(options_.screenshot, pixels);
      return Result();
    }
    if (!options_.screenshot.empty())
      throw Interrupted("stopped before the screenshot was taken; start it again");
    return Result();
  }

 private:
  // With dots while something is still being made.
  std::string Title(bool settled) const {
    return "luxfield " + options_.input.file.filename().string() + (settled ? "" : " ...");
  }

  // Until it is closed, or what it shows when it is closed has come to rest.
  bool Goes() const {
    return core::InterruptCount() == 0 && (options_.until_closed || !window_.ShouldClose());
  }

  double Wait() const {
    if (!options_.screenshot.empty() && IsEnding()) return 0.001;
    if (ImGui::GetTime() < active_until_s_) return kActive_s;
    return document_->Settled() ? document_->PollingInterval() : kBusy_s;
  }

  bool IsLastFrame() const {
    if (options_.screenshot.empty()) return false;
    if (options_.until_closed) return closed_frames_ >= 2 && IsAtRest();
    if (window_.ShouldClose()) return true;
    return options_.frames ? frames_ >= *options_.frames : IsAtRest();
  }
  bool IsAtRest() const {
    return document_->Settled() && frames_ >= kLeastFrames && settled_frames_ >= 2;
  }
  // Whether only frames are missing until the screenshot.
  bool IsEnding() const {
    if (options_.until_closed && !window_.ShouldClose()) return false;
    return options_.frames ? frames_ > 0 : document_->Settled();
  }

  // ImGui shows what a hand did over a few frames.
  void SeeHands() {
    const ImGuiIO& io = ImGui::GetIO();
    const bool keys =
        std::find(std::begin(io.KeysDown), std::end(io.KeysDown), true) != std::end(io.KeysDown);
    if (keys || ImGui::IsAnyMouseDown() || io.MouseWheel != 0 || io.MouseDelta.x != 0 ||
        io.MouseDelta.y != 0)
      active_until_s_ = ImGui::GetTime() + kAfterwards_s;
  }

  void Draw() {
    SeeHands();
    settled_frames_ = document_->Settled() ? settled_frames_ + 1 : 0;
    closed_frames_ += window_.ShouldClose();
    const render::Frame* frame = document_->picture();
    if (frame) {
      ChooseExposure(*frame);
      document_->WantFeedback(look_.tone == Tone::kFalseColour && IsFeedback(look_.layer));
      shown_.Update(*document_, look_, sources());
    }
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const float panel =
        bare_ ? 0 : std::min(static_cast<float>(kPanelWidth) * ImGui::GetFontSize(), 0.5f * size.x);
    const float bar = bare_ ? 0 : BarHeight(size.x);
    ReadKeys();
    DrawMiddle(ImVec2(size.x - panel, size.y - bar));
    if (!bare_) {
      DrawSidePanel(ImVec2(size.x - panel, 0), ImVec2(panel, size.y - bar));
      DrawBar(ImVec2(0, size.y - bar), ImVec2(size.x, bar));
    }
    DrawHelp(help_);
    DrawQuestion();
  }

  static bool IsPopupOpen() {
    return ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel);
  }

  // A window that is closed while something is not saved asks first; scripts know what they do.
  void KeepUnsaved() {
    if (!window_.ShouldClose() || sure_ || !options_.screenshot.empty() || !document_->HasUnsaved())
      return;
    window_.StayOpen();
    asks_ = true;
  }

  void DrawQuestion() {
    if (std::exchange(asks_, false)) ImGui::OpenPopup(kQuestion);
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(0.5f * size.x, 0.5f * size.y), ImGuiCond_Always,
                            ImVec2(0.5f, 0.5f));
    if (!ImGui::BeginPopupModal(kQuestion, nullptr,
                                ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove))
      return;
    ImGui::Text("%s has changes that are not saved.",
                core::OnOneLine(options_.input.file.filename().string()).c_str());
    const bool save = ImGui::Button("Save and close");
    ImGui::SameLine();
    const bool drop = ImGui::Button("Close without");
    ImGui::SameLine();
    if (save || drop || ImGui::Button("Stay")) ImGui::CloseCurrentPopup();
    ImGui::EndPopup();
    sure_ = drop || (save && document_->Save());
    if (sure_) window_.Close();
  }

  // The linear operator starts where the mean is a middle grey.
  void ChooseExposure(const render::Frame& frame) {
    if (exposure_chosen_ || options_.look) return;
    exposure_chosen_ = true;
    const double mean = MeanLuminance(frame.radiance);
    if (mean > 0 && std::isfinite(mean)) look_.exposure = kMiddleGrey / mean;
  }

  // Leaves what was opened last: a pop-up, a field that is typed into, the help, the window.
  void Escape() {
    if (IsPopupOpen())
      ImGui::ClosePopupToLevel(0, true);
    else if (help_)
      help_ = false;
    else if (!ImGui::IsAnyItemActive())
      window_.Close();
  }

  void ReadKeys() {
    const ImGuiIO& io = ImGui::GetIO();
    if (ImGui::IsKeyPressed(key::kF1, false)) help_ = !help_;
    if (ImGui::IsKeyPressed(key::kEscape, false)) Escape();
    if (io.KeyCtrl && ImGui::IsKeyPressed(key::kQ, false)) window_.Close();
    if (io.WantTextInput || IsPopupOpen()) return;
    if (ImGui::IsKeyPressed(key::kH, false)) bare_ = !bare_;
    if (ImGui::IsKeyPressed(key::k1, false)) look_.tone = Tone::kExponential;
    if (ImGui::IsKeyPressed(key::k2, false)) look_.tone = Tone::kLinear;
    if (ImGui::IsKeyPressed(key::k3, false)) look_.tone = Tone::kFalseColour;
    if (ImGui::IsKeyPressed(key::k4, false)) look_.tone = Tone::kExponentialHue;
    if (ImGui::IsKeyPressed(key::k5, false)) look_.tone = Tone::kFilmic;
    if (ImGui::IsKeyPressed(key::kL, false)) look_.contours = !look_.contours;
    if (ImGui::IsKeyPressed(key::kDelete, false)) readings_.Clear();
    const double third = std::exp2(1.0 / 3);
    double& exposure = look_.tone == Tone::kLinear ? look_.exposure : look_.k;
    if (ImGui::IsKeyPressed(key::kPlus) || ImGui::IsKeyPressed(key::kPadPlus)) exposure *= third;
    if (ImGui::IsKeyPressed(key::kMinus) || ImGui::IsKeyPressed(key::kPadMinus)) exposure /= third;
    Motion motion;
    const double held = std::min(static_cast<double>(io.DeltaTime), 0.1);
    const auto held_for = [&](Key more, Key less) {
      return held * (ImGui::IsKeyDown(more) - ImGui::IsKeyDown(less));
    };
    // Of Ctrl and a letter hands may let go of Ctrl first: the letter does not fly then.
    const bool letter = std::ranges::any_of(kFlying, [](Key k) { return ImGui::IsKeyDown(k); });
    of_shortcut_ = io.KeyCtrl || (of_shortcut_ && letter);
    if (!of_shortcut_) {
      motion.fly_forward = held_for(key::kW, key::kS);
      motion.fly_right = held_for(key::kD, key::kA);
      motion.fly_up = held_for(key::kE, key::kQ);
      motion.reset = ImGui::IsKeyPressed(key::kR, false);
    }
    motion.fast = io.KeyShift;
    if (motion.Moves() && document_->HasCamera()) document_->Move(motion);
  }

  void DrawMiddle(ImVec2 size) {
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::SetNextWindowSize(size);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
    ImGui::Begin("middle", nullptr,
                 kFixed | ImGuiWindowFlags_NoScrollWithMouse | ImGuiWindowFlags_NoScrollbar);
    ImGui::PopStyleVar();  // tooltips have theirs
    pointer_.reset();
    if (document_->picture() && !document_->failure()) {
      area_.Draw(*document_, shown_.texture());
      pointer_ = area_.pointer();
      const bool taken = !bare_ && document_->DrawOver(area_.rect(), area_.hovered());
      if (area_.double_clicked() && !taken) readings_.Add(*pointer_);
      readings_.Mark(area_);
      if (area_.motion().Moves() && !taken) document_->Move(area_.motion());
    } else {
      document_->DrawMain();
    }
    ImGui::End();
  }

  void DrawSidePanel(ImVec2 at, ImVec2 size) {
    ImGui::SetNextWindowPos(at);
    ImGui::SetNextWindowSize(size);
    ImGui::Begin("panel", nullptr, kFixed);
    ImGui::PushItemWidth(0.6f * ImGui::GetContentRegionAvail().x);
    ImGui::PushTextWrapPos(0);  // at the panel's edge
    if (const render::Frame* frame = document_->picture())
      DrawLookPanel(*frame, shown_.scale(), sources(), document_->OffersFeedback(), look_);
    document_->DrawPanel();
    if (document_->picture()) readings_.Draw(*document_, look_, shown_.saturated());
    ImGui::Spacing();
    ImGui::TextDisabled("F1: keys and mouse");
    ImGui::PopTextWrapPos();
    ImGui::PopItemWidth();
    ImGui::End();
  }

  LayerSources sources() const {
    return {reference_ ? &*reference_ : nullptr, document_->feedback()};
  }

  std::optional<Reading> ReadingAt(PicturePlace place) const {
    const WindowSize whole = document_->picture_size();
    auto reading = ReadAtPlace(*document_->picture(), place, whole.width, whole.height);
    if (reading) reading->measured_rel_sigma = document_->MeasuredRelSigma(*reading);
    return reading;
  }

  static bool IsOneLine(float width) {
    return width >= static_cast<float>(kOneLine) * ImGui::GetFontSize();
  }
  static float BarHeight(float width) {
    const float one = ImGui::GetFrameHeightWithSpacing();
    return IsOneLine(width) ? one : one + ImGui::GetTextLineHeightWithSpacing();
  }

  // The last line: on the left the value under the pointer, on the right how far the picture is; in
  // narrow windows below it.
  void DrawBar(ImVec2 at, ImVec2 size) {
    ImGui::SetNextWindowPos(at);
    ImGui::SetNextWindowSize(size);
    const ImVec2 padding = ImGui::GetStyle().FramePadding;
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, padding);
    ImGui::Begin("bar", nullptr, kFixed | ImGuiWindowFlags_NoScrollbar);
    if (pointer_)
      if (const auto reading = ReadingAt(*pointer_))
        ImGui::TextUnformatted(Describe(*reading, document_->picture()->unit).c_str());
    const std::string status = document_->Status();
    const float below = IsOneLine(size.x) ? 0 : ImGui::GetTextLineHeightWithSpacing();
    ImGui::SetCursorPos(
        ImVec2(std::max(padding.x, size.x - ImGui::CalcTextSize(status.c_str()).x - 2 * padding.x),
               padding.y + below));
    ImGui::TextUnformatted(status.c_str());
    ImGui::End();
    ImGui::PopStyleVar();
  }

  ViewerResult Result() const {
    ViewerResult result;
    result.failure = document_->failure();
    result.frames = frames_;
    result.settled = document_->Settled();
    if (const render::Frame* frame = document_->picture()) {
      result.picture = {frame->width, frame->height};
      result.error = document_->Error();
      result.unit = frame->unit;
      const WindowSize whole = document_->picture_size();
      for (const auto& [column, row] : options_.reads)
        if (const auto reading =
                ReadingAt({(column + 0.5) / whole.width, (row + 0.5) / whole.height}))
          result.readings.push_back(*reading);
      for (const PicturePlace& place : readings_.probes())
        if (const auto reading = ReadingAt(place)) result.probes.push_back(*reading);
    }
    return result;
  }

  const ViewerOptions& options_;
  Window window_;
  std::unique_ptr<Document> document_;
  ShownPicture shown_;
  PictureArea area_;
  Look look_;
  std::optional<core::Image> reference_;
  bool bare_ = false, help_ = false, exposure_chosen_ = false;
  bool asks_ = false, sure_ = false;  // before the window closes with changes
  double active_until_s_ = 0;
  std::optional<PicturePlace> pointer_;
  ReadingsPanel readings_;
  int frames_ = 0, settled_frames_ = 0;
  bool of_shortcut_ = false;  // the letters that are down
  int closed_frames_ = 0;     // since it was told to close
};

}  // namespace

ViewerResult RunViewer(const ViewerOptions& options) { return Viewer(options).Run(); }

}  // namespace luxfield::view
