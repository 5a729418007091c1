#include "luxfield/view/documents/picture_document.h"

#include <fmt/format.h>
#include <imgui.h>

#include <cmath>

#include "luxfield/core/printable.h"
#include "luxfield/render/accuracy/picture_noise.h"
#include "luxfield/view/picture/read_picture.h"

namespace luxfield::view {
namespace {

class PictureDocument : public Document {
 public:
  explicit PictureDocument(const std::filesystem::path& path) : frame_(ReadPicture(path)) {
    if (!frame_.variance.data.empty()) error_ = render::NoiseOf(frame_, 1).RelativeError();
  }

  const render::Frame* picture() const override { return &frame_; }
  WindowSize picture_size() const override { return {frame_.width, frame_.height}; }
  std::optional<double> Error() const override { return error_; }

  void DrawPanel() override {
    if (!ImGui::CollapsingHeader("Picture", ImGuiTreeNodeFlags_DefaultOpen)) return;
    ImGui::Text("%d x %d pixels", frame_.width, frame_.height);
    ImGui::Text("radiance in %s", render::RadianceUnitName(frame_.unit).c_str());
    if (error_) ImGui::Text("noise %.3g %% of the mean", 100 * *error_);
    if (frame_.provenance.empty()) return;
    if (!ImGui::TreeNode("Where it comes from")) return;
    for (const auto& [name, value] : frame_.provenance)
      ImGui::TextWrapped("%s: %s", core::OnOneLine(name).c_str(), core::OnOneLine(value).c_str());
    ImGui::TreePop();
  }

 private:
  render::Frame frame_;
  std::optional<double> error_;
};

}  // namespace

std::unique_ptr<Document> OpenPicture(const std::filesystem::path& path) {
  return std::make_unique<PictureDocument>(path);
}

}  // namespace luxfield::view
