// A document's picture as it stands on the screen: its colours, made anew when it or the look changes.
#pragma once

#include <cstdint>
#include <optional>

#include "luxfield/view/documents/document.h"
#include "luxfield/view/picture/look.h"
#include "luxfield/view/window/screen_texture.h"

namespace luxfield::view {

class ShownPicture {
 public:
  // Of a document that has a picture.
  void Update(const Document& document, const Look& look, const LayerSources& sources);

  const ScreenTexture& texture() const { return texture_; }
  // What its false colours span; of any look.
  const render::FalseColourScale& scale() const { return scale_; }
  // Saturated (view/picture/look.h) of what it shows; empty of false colours.
  const std::optional<double>& saturated() const { return saturated_; }

 private:
  // What the texture shows: a picture's number, and how.
  struct Drawn {
    std::uint64_t number = 0;
    Look look;
    bool operator==(const Drawn&) const = default;
  };
  std::optional<Drawn> drawn_;
  ScreenTexture texture_;
  std::optional<double> saturated_;
  render::FalseColourScale scale_{1e-3, 1};
};

}  // namespace luxfield::view
