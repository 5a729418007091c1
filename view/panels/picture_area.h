// The picture in its part of the window, and the mouse on it.
#pragma once

#include <optional>

#include "luxfield/view/documents/document.h"
#include "luxfield/view/picture/reading.h"
#include "luxfield/view/window/screen_texture.h"

namespace luxfield::view {

// Where a picture without a camera is looked at.
struct Zoom {
  double factor = 1;         // over what fits
  double right = 0, up = 0;  // the picture's middle from the area's, in parts of the shown height
};

class PictureArea {
 public:
  // Fills what is left of the ImGui window that is begun with the document's picture: one of its
  // pixels on one, or a whole number, of the screen's where that fits, else as large as fits.
  void Draw(const Document& document, const ScreenTexture& texture);

  // Of the frame drawn last.
  std::optional<PicturePlace> pointer() const { return pointer_; }
  bool double_clicked() const { return double_clicked_; }
  const Motion& motion() const { return motion_; }
  bool hovered() const { return hovered_; }
  PictureRect rect() const { return {left_, top_, width_, height_}; }
  // Draws a small cross at a place of the picture.
  void Mark(PicturePlace place, int number) const;
  // And a thin line between two.
  void MarkLine(PicturePlace from, PicturePlace to) const;

 private:
  void ReadMouse(bool has_camera, double height);

  Zoom zoom_;
  Motion motion_;
  std::optional<PicturePlace> pointer_;
  bool double_clicked_ = false, hovered_ = false;
  double left_ = 0, top_ = 0, width_ = 0, height_ = 0;  // of the picture on the screen
};

}  // namespace luxfield::view
