// The coefficient images of a light field as a contact sheet, and how well they were measured.
#pragma once

#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/lightfield/posed_light_field.h"
#include "luxfield/render/film/film.h"
#include "luxfield/view/picture/contact_sheet.h"
#include "luxfield/view/window/screen_texture.h"

namespace luxfield::view {

class ImagesPanel {
 public:
  // Begins to read a light field anew, and X.sigma.lf.exr beside it if that is there.
  void Read(const std::filesystem::path& light_field);
  // Whether nothing is being read any more.
  bool ready() const;
  // Takes what was read, whether the panel is drawn or not.
  void Update();
  // Draws into the ImGui window that is begun, and the sheet in a window of its own where that is asked
  // for.
  void Draw();

 private:
  struct Fields {
    std::vector<lightfield::PosedLightField> c, sigma;  // sigma empty: not known
  };
  const lightfield::LightField& Shown() const;
  void MakeSheet();
  void DrawSheet(float width);
  void DrawTip(int column, int row) const;

  mutable std::future<Fields> reading_;
  std::optional<Fields> fields_;
  std::string refusal_;  // why there are none
  std::size_t field_ = 0;
  bool shows_sigma_ = false, large_ = false;
  ContactSheet sheet_;
  render::FalseColourScale scale_;
  std::unique_ptr<ScreenTexture> texture_;
};

}  // namespace luxfield::view
