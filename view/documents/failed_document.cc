#include "luxfield/view/documents/failed_document.h"

#include <imgui.h>

#include <algorithm>

#include "luxfield/core/printable.h"

namespace luxfield::view {
namespace {

class Failed : public Document {
 public:
  explicit Failed(Failure failure) : failure_(std::move(failure)) {}
  void DrawMain() override { DrawSentence("This cannot be shown", failure_.sentence); }
  std::optional<Failure> failure() const override { return failure_; }

 private:
  Failure failure_;
};

}  // namespace

std::unique_ptr<Document> FailedDocument(const Failure& failure) {
  return std::make_unique<Failed>(failure);
}

void DrawSentence(const std::string& title, const std::string& sentence) {
  const ImVec2 room = ImGui::GetContentRegionAvail(), begin = ImGui::GetCursorPos();
  const float width = std::min(room.x * 0.8f, 40 * ImGui::GetFontSize());
  const std::string text = core::OnOneLine(sentence);
  const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, width);
  const float line = ImGui::GetTextLineHeightWithSpacing();
  const ImVec2 at(begin.x + 0.5f * (room.x - width),
                  begin.y + std::max(0.0f, 0.45f * (room.y - size.y) - 1.5f * line));
  ImGui::SetCursorPos(at);
  ImGui::TextDisabled("%s", title.c_str());
  ImGui::SetCursorPos(ImVec2(at.x, at.y + 1.5f * line));
  ImGui::PushTextWrapPos(at.x + width);
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
}

}  // namespace luxfield::view
