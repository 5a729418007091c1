#include "luxfield/view/documents/scene_document.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>

#include "luxfield/core/printable.h"
#include "luxfield/core/progress.h"
#include "luxfield/view/documents/failed_document.h"
#include "luxfield/view/documents/images_panel.h"
#include "luxfield/view/documents/lamp_gizmo.h"
#include "luxfield/view/documents/lamps_panel.h"
#include "luxfield/view/documents/scene_panel.h"
#include "luxfield/view/lighting/camera_control.h"
#include "luxfield/view/lighting/lighting_thread.h"
#include "luxfield/view/lighting/measured_lamps.h"
#include "luxfield/view/lighting/stage.h"
#include "luxfield/view/scene_file/file_watch.h"
#include "luxfield/view/scene_file/scene_editor.h"

namespace luxfield::view {
namespace {

constexpr double kOrbit = 3.0;  // radians a picture's height
constexpr double kTurn = 1.2;
constexpr double kDolly = 0.88;       // of the distance, a notch
constexpr double kNegligible = 1e-4;  // of errors that are told
constexpr double kFly = 0.8;          // distances of the pivot a second

class SceneDocument : public Document {
 public:
  SceneDocument(const SceneOptions& options, SceneKind kind)
      : options_(options),
        kind_(kind),
        stage_(kind == SceneKind::kStage),
        thread_({.load = [options, kind] { return LoadScene(options, kind); },
                 .device = options.device,
                 .threads = options.threads,
                 .wake = Window::Wake}) {
    if (stage_) images_.Read(options.file);
  }

  void Update() override {
    if (!scene_) {
      scene_ = thread_.scene();
      if (scene_) Start();
    }
    if (scene_) FollowFiles();
    images_.Update();
    if (reading_lamps_.valid() &&
        reading_lamps_.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
      TakeLamps();
    if (const auto refusal = thread_.TakeRefusal()) TakeBack(refusal->sentence);
    if (auto picture = thread_.Take()) Take(std::move(*picture));
  }

  const render::Frame* picture() const override { return picture_.frame.get(); }
  std::uint64_t picture_number() const override { return number_; }
  WindowSize picture_size() const override {
    return {request_.camera.width, request_.camera.height};
  }

  const render::Feedback* feedback() const override { return picture_.feedback.get(); }
  bool OffersFeedback() const override { return true; }
  void WantFeedback(bool wanted) override {
    wants_feedback_ = wanted;
    thread_.WantFeedback(wanted);
  }

  std::optional<double> MeasuredRelSigma(const Reading& reading) const override {
    if (!measured_ || !reading.position || !reading.normal) return {};
    return measured_->RelativeSigma(*reading.position, *reading.normal, request_.lamps);
  }

  void DrawMain() override {
    if (const auto failed = failure())
      DrawSentence("This cannot be shown", failed->sentence);
    else
      DrawSentence(options_.file.filename().string(),
                   scene_ ? "Building tables ..." : "Reading the scene and its lamps ...");
  }

  bool DrawOver(const PictureRect& area, bool hovered) override {
    if (!editor_ || !picture_.frame || !lamps_panel_.handles()) return false;
    std::size_t& chosen = lamps_panel_.chosen();
    chosen = std::min(chosen, std::max<std::size_t>(editor_->lamps().size(), 1) - 1);
    if (gizmo_.Draw(area, hovered, request_.camera, *editor_, chosen)) AskEdited();
    return gizmo_.has_mouse();
  }

  void DrawPanel() override {
    if (!scene_) return;
    if (stage_) DrawDistance();
    if (stage_) images_.Draw();
    if (editor_)
      DrawEdits();
    else
      scene_panel_.DrawSaid();
    DrawQuality();
    DrawCamera();
    DrawMessages();
  }

  bool HasCamera() const override { return true; }
  void Move(const Motion& motion) override {
    if (!control_) return;
    if (motion.reset)
      control_.emplace(stage_
                           ? StageCamera(distance_m_, request_.camera.width, request_.camera.height)
                           : scene_->camera,
                       control_->pivot_m());
    if (motion.drag == Motion::Drag::kOrbit)
      control_->Orbit(-kOrbit * motion.right, kOrbit * -motion.up);
    if (motion.drag == Motion::Drag::kTurn)
      control_->Turn(-kTurn * motion.right, -kTurn * motion.up);
    if (motion.drag == Motion::Drag::kPan) control_->Pan(-motion.right, -motion.up);
    if (motion.wheel != 0) control_->Dolly(std::pow(kDolly, motion.wheel));
    const double speed = kFly * control_->pivot_m() * (motion.fast ? 4 : 1);
    control_->Fly(speed * motion.fly_right, speed * motion.fly_up, speed * motion.fly_forward);
    Ask();
  }

  std::string Status() const override {
    if (failure()) return "stopped";
    if (!picture_.frame) return scene_ ? "building tables" : "reading";
    if (reading_.valid()) return "reading the scene again";
    if (waits_for_lamps_) return "reading lamps";
    const std::string time = fmt::format("{:.0f} ms", 1000 * picture_.took_s);
    const std::string error =
        picture_.error ? fmt::format("{:.3g} %", 100 * *picture_.error) : std::string();
    if (picture_.quick)
      return fmt::format(
          "preview {} x {} in {}, {}", picture_.frame->width, picture_.frame->height, time,
          picture_.error ? "within " + error + " but for what it leaves out" : SoftShadows());
    const std::string asked = fmt::format("{:.3g} %", 100 * request_.error);
    if (picture_.done)
      return fmt::format("error {}: {} {} {}", error, asked,
                         picture_.reached ? "reached" : "not reached", Taken());
    return fmt::format("error {} on the way to {}: {:.0f} samples of {}, {} a round", error, asked,
                       picture_.samples, picture_.estimator, core::FormatDuration(picture_.took_s));
  }

  bool Settled() const override {
    return failure() || (picture_.frame && picture_.done && !picture_.quick && !reading_.valid() &&
                         !reading_lamps_.valid() && images_.ready() &&
                         (picture_.soft_maps_error || !HasSoftShadows()) &&
                         (picture_.feedback || !wants_feedback_));
  }
  std::optional<double> Error() const override {
    if (!picture_.frame || picture_.quick) return {};
    return picture_.error;
  }
  bool HasUnsaved() const override { return editor_ && editor_->changed(); }
  bool Save() override { return !editor_ || scene_panel_.Save(*editor_); }
  std::optional<Failure> failure() const override { return thread_.failure(); }

 private:
  bool HasSoftShadows() const {
    return request_.shadows && request_.moving_shadows && !request_.lamps.empty();
  }

  // What a picture took that is done.
  std::string Taken() const {
    if (picture_.samples == 0) return fmt::format("by {}, without noise", picture_.estimator);
    return fmt::format("with {:.0f} samples a pixel of {}", picture_.samples, picture_.estimator);
  }

  // What is known of the shadows of pictures while something moves.
  std::string SoftShadows() const {
    if (!request_.shadows || !request_.moving_shadows) return "without shadows";
    if (request_.lamps.empty()) return "shadows by a few samples";  // of lights that have no maps
    if (!soft_maps_error_) return "error of soft shadows not measured yet";
    if (*soft_maps_error_ < kNegligible)
      return "soft shadows less than 0.01 % off when last at rest";
    return fmt::format("soft shadows {:.2g} % off when last at rest", 100 * *soft_maps_error_);
  }

  void Start() {
    control_.emplace(scene_->camera);
    request_ = RequestOf(*scene_, options_);
    watch_.Watch(FilesOf(*scene_));
    try {
      OpenEditor();
    } catch (const std::exception&) {  // the file is another by now, and will be read again
      scene_panel_.Say(CurrentFailure().sentence);
    }
    Ask();
  }

  // What is known of the lamps beside their light, in the background: it takes as long as the files
  // are large.
  void ReadLamps() {
    measured_.reset();
    reading_lamps_ =
        std::async(std::launch::async, [scene = request_.scene ? request_.scene : scene_] {
          auto measured = std::make_shared<const MeasuredLamps>(*scene);
          Window::Wake();
          return measured;
        });
  }
  void TakeLamps() {
    try {
      measured_ = reading_lamps_.get();
    } catch (const std::exception&) {
      scene_panel_.Say(CurrentFailure().sentence);
    }
  }

  void OpenEditor() {
    ReadLamps();
    if (stage_) return;
    editor_.emplace(*scene_);
    lit_ = editor_->edits();
    saves_seen_ = 0;
  }

  // Reads the scene anew when others wrote its file or a lamp's, unless there are changes to lose.
  void FollowFiles() {
    if (editor_ && editor_->saves() != saves_seen_) {
      saves_seen_ = editor_->saves();
      watch_.Accept(options_.file);
      watch_.Watch(FilesOf(request_.scene ? *request_.scene : *scene_));
    }
    if (reading_.valid()) {
      if (reading_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) TakeReading();
      return;
    }
    const bool written = watch_.Changed();
    written_ = written_ || written;
    if (!written_) return;
    if (editor_ && editor_->changed()) {
      if (written)
        scene_panel_.Say(
            "A file of the scene was written by others. It is read again once your changes are "
            "saved "
            "or undone.");
      return;
    }
    written_ = false;
    reading_ = std::async(std::launch::async, [options = options_, kind = kind_] {
      return std::make_shared<const scene::Scene>(LoadScene(options, kind));
    });
  }

  // What is lit, and can be gone back to.
  struct Lit {
    std::shared_ptr<const scene::Scene> scene;
    std::optional<SceneEditor> editor;
    LitRequest request;
    SceneEdits edits;
  };

  // A scene that is whole but cannot be lit is given up again: TakeBack.
  void TakeReading() {
    const Lit before{scene_, editor_, request_, lit_};
    try {
      scene_ = reading_.get();
      watch_.Watch(FilesOf(*scene_));
      OpenEditor();
      before_reading_ = before;
      request_.scene = scene_;
      const LitRequest anew = RequestOf(*scene_, options_);
      request_.lamps = anew.lamps;
      request_.classical_lights = anew.classical_lights;
      request_.environment.reset();
      request_.materials.reset();
      if (stage_) request_.lamps.at(0).world_from_luminaire = StageLamp(distance_m_);
      if (stage_) images_.Read(options_.file);
      scene_panel_.Say("read again, as the file was written");
      Ask();
    } catch (const std::exception&) {
      GoBackTo(before);
      scene_panel_.Say(CurrentFailure().sentence);
    }
  }

  void DrawEdits() {
    bool changed = scene_panel_.DrawHistory(*editor_);
    changed |= lamps_panel_.Draw(request_.camera, *editor_);
    changed |= scene_panel_.DrawEnvironment(*editor_);
    changed |= scene_panel_.DrawMaterials(*editor_);
    if (changed) AskEdited();
  }

  // Asks for the scene as it is edited: anew where it has other lamps, else with its things elsewhere.
  void AskEdited() {
    const SceneEdits& now = editor_->edits();
    if (!SameLamps(now, lit_)) {
      if (!waits_for_lamps_) {
        shown_ = lit_;
        shown_scene_ = request_.scene;
      }
      waits_for_lamps_ = true;
      request_.scene = std::make_shared<const scene::Scene>(editor_->Apply(*scene_));
      ReadLamps();
    }
    if (!now.lamps.empty()) {
      request_.lamps.clear();
      request_.classical_lights.clear();
      for (const LampPlacement& lamp : now.lamps)
        (lamp.IsClassical() ? request_.classical_lights : request_.lamps)
            .push_back({lamp.WorldFromLuminaire().value(), lamp.scale, lamp.colour});
    }
    if (now.environment)
      request_.environment =
          PlacedSky{scene::RotationXyz(now.environment->rotate_deg), now.environment->scale};
    if (now.materials != lit_.materials)
      request_.materials =
          std::make_shared<const std::vector<scene::Material>>(editor_->MaterialsOf(*scene_));
    lit_ = now;
    Ask();
  }

  // What cannot be lit is undone: a file that others wrote, which is read again once they have written
  // it again, or lamps that were exchanged here.
  void TakeBack(const std::string& why) {
    scene_panel_.Say(why);
    if (before_reading_) {
      GoBackTo(*std::exchange(before_reading_, {}));
      return Ask();
    }
    if (!waits_for_lamps_ || !editor_) return;
    while (!SameLamps(editor_->edits(), shown_) && editor_->CanUndo()) editor_->Undo();
    waits_for_lamps_ = false;
    request_.scene = shown_scene_;
    lit_ = shown_;
    ReadLamps();
    AskEdited();
  }

  void GoBackTo(const Lit& lit) {
    scene_ = lit.scene;
    editor_ = lit.editor;
    request_ = lit.request;
    lit_ = lit.edits;
    saves_seen_ = editor_ ? editor_->saves() : 0;
    ReadLamps();
  }

  void Ask() {
    request_.camera = control_->camera();
    picture_.done = picture_.reached = false;
    thread_.Ask(request_);
  }

  void Take(LitPicture picture) {
    picture_ = std::move(picture);
    if (!request_.scene || picture_.scene == request_.scene) {
      waits_for_lamps_ = false;
      before_reading_.reset();
    }
    if (picture_.soft_maps_error) soft_maps_error_ = picture_.soft_maps_error;
    if (number_++ == 0) control_->SetPivot(DistanceAhead());
  }

  // To what the middle of the picture shows; 1 m where that is nothing.
  double DistanceAhead() const {
    const render::Frame& frame = *picture_.frame;
    const int row = frame.height / 2, column = frame.width / 2;
    if (!(frame.coverage.at(0, row, column) > 0)) return 1;
    const lightfield::Vec3 seen{frame.position.at(0, row, column),
                                frame.position.at(1, row, column),
                                frame.position.at(2, row, column)};
    return lightfield::Length(seen - request_.camera.position);
  }

  void DrawDistance() {
    if (!ImGui::CollapsingHeader("Stage", ImGuiTreeNodeFlags_DefaultOpen)) return;
    float distance = static_cast<float>(distance_m_);
    if (!ImGui::SliderFloat("screen", &distance, static_cast<float>(kNearestScreen_m),
                            static_cast<float>(kFarthestScreen_m), "%.3g m",
                            ImGuiSliderFlags_Logarithmic))
      return;
    distance_m_ = std::clamp(double{distance}, kNearestScreen_m, kFarthestScreen_m);
    request_.lamps.at(0).world_from_luminaire = StageLamp(distance_m_);
    const scene::Camera& now = control_->camera();
    control_.emplace(StageCamera(distance_m_, now.width, now.height), distance_m_);
    Ask();
  }

  void DrawQuality() {
    if (!ImGui::CollapsingHeader("Speed and accuracy", ImGuiTreeNodeFlags_DefaultOpen)) return;
    float rate = static_cast<float>(1 / request_.frame_s);
    if (ImGui::SliderFloat("pictures / s", &rate, 1, 60, "%.0f", ImGuiSliderFlags_Logarithmic))
      request_.frame_s = 1 / std::max(rate, 1.0f);
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("while something moves; more of them have fewer pixels");
    float percent = static_cast<float>(100 * request_.error);
    if (ImGui::SliderFloat("error", &percent, 0.05f, 10, "%.2f %%", ImGuiSliderFlags_Logarithmic)) {
      request_.error = std::max(percent, 0.01f) / 100;
      Ask();
    }
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("RMSE of the luminance over its mean, when nothing moves");
    if (ImGui::Checkbox("shadows", &request_.shadows)) Ask();
    ImGui::SameLine();
    if (ImGui::Checkbox("while moving", &request_.moving_shadows)) Ask();
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip(
          "soft shadow maps; at rest they are compared with traced shadows:\n"
          "RMSE of the luminance over its mean");
    ImGui::TextDisabled("previews: %s", SoftShadows().c_str());
    ImGui::TextDisabled("on %s", core::OnOneLine(thread_.device_name()).c_str());
  }

  void DrawCamera() {
    if (!ImGui::CollapsingHeader("Camera")) return;
    const scene::Camera& camera = control_->camera();
    float fov = static_cast<float>(camera.vertical_fov_deg);
    if (ImGui::SliderFloat("height of view", &fov, 5, 120, "%.1f deg")) {
      control_->SetFieldOfView(fov);
      Ask();
    }
    ImGui::Text("at %.3f %.3f %.3f m", camera.position.x, camera.position.y, camera.position.z);
    ImGui::Text("turns about %.3g m ahead", control_->pivot_m());
    if (ImGui::Button("As in the file")) Move({.reset = true});
    if (!editor_) return;
    if (const auto view = scene_panel_.DrawViews(*control_, *editor_)) {
      control_.emplace(CameraOf(*view, control_->camera()), control_->pivot_m());
      Ask();
    }
  }

  void DrawMessages() const {
    const auto messages = thread_.messages();
    if (messages.empty() || !ImGui::CollapsingHeader("Messages")) return;
    for (const auto& message : messages) ImGui::TextWrapped("%s", core::OnOneLine(message).c_str());
  }

  const SceneOptions options_;
  const SceneKind kind_;
  const bool stage_;
  double distance_m_ = kFirstScreen_m;         // of the stage's screen
  std::shared_ptr<const scene::Scene> scene_;  // as it was read last
  FileWatch watch_;
  int saves_seen_ = 0;
  bool written_ = false;                                      // by others, and not read yet
  std::future<std::shared_ptr<const scene::Scene>> reading_;  // anew
  std::shared_ptr<const MeasuredLamps> measured_;
  std::future<std::shared_ptr<const MeasuredLamps>> reading_lamps_;
  ImagesPanel images_;  // of a light field alone
  std::optional<CameraControl> control_;
  std::optional<SceneEditor> editor_;  // of a scene's file
  SceneEdits lit_;                     // that was asked for last
  // Before lamps were asked for that no picture shows yet.
  SceneEdits shown_;
  std::shared_ptr<const scene::Scene> shown_scene_;
  std::optional<Lit> before_reading_;  // of a file whose scene no picture shows yet
  bool waits_for_lamps_ = false, wants_feedback_ = false;
  LampsPanel lamps_panel_;
  ScenePanel scene_panel_;
  LampGizmo gizmo_;
  LitRequest request_;
  LitPicture picture_;
  std::optional<double> soft_maps_error_;  // measured last
  std::uint64_t number_ = 0;
  LightingThread thread_;  // last: it ends first
};

}  // namespace

std::unique_ptr<Document> OpenScene(const SceneOptions& options, SceneKind kind) {
  return std::make_unique<SceneDocument>(options, kind);
}

}  // namespace luxfield::view
