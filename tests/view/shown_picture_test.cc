// A picture on the graphics card follows the document and the look.
#include "luxfield/view/panels/shown_picture.h"

#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "luxfield/view/window/window.h"
#include "tests/view/virtual_display.h"

namespace luxfield::view {
namespace {

struct Pictures : Document {
  explicit Pictures(WindowSize size) : whole(size) {}
  const render::Frame* picture() const override { return &frame; }
  std::uint64_t picture_number() const override { return number; }
  WindowSize picture_size() const override { return whole; }

  void Take(int width, int height, float value) {
    frame.width = width;
    frame.height = height;
    frame.radiance = core::Image(width, height, 3);
    std::ranges::fill(frame.radiance.data, value);
    ++number;
  }

  WindowSize whole;
  render::Frame frame;
  std::uint64_t number = 0;
};

// What OpenGL holds of it.
struct Held {
  int width, height, magnified;
  std::uint8_t red;  // of the first pixel
};
Held HeldOf(const ShownPicture& shown) {
  const ScreenTexture& texture = shown.texture();
  std::vector<std::uint8_t> rgba(4u * std::max(1, texture.width() * texture.height()));
  Held held{texture.width(), texture.height(), 0, 0};
  glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(reinterpret_cast<std::uintptr_t>(texture.id())));
  glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, &held.magnified);
  if (texture.width() > 0) glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  held.red = rgba[0];
  return held;
}

TEST(ShownPictureTest, FollowsThePictureAndTheLook) {
  const auto display = VirtualDisplay::Start();
  if (!display) GTEST_SKIP() << "SKIPPED: Xvfb is missing: no picture in a window is tested";
  const Window window("picture", {64, 64});
  ShownPicture shown;
  Pictures pictures({4, 3});
  Look look;
  look.tone = Tone::kLinear;

  // A preview is smaller: its pixels blend.
  pictures.Take(2, 2, 0.25f);
  shown.Update(pictures, look, {});
  Held held = HeldOf(shown);
  EXPECT_EQ(held.width, 2);
  EXPECT_EQ(held.height, 2);
  EXPECT_EQ(held.magnified, GL_LINEAR);
  EXPECT_EQ(held.red, EncodeByte(0.25));

  // The picture itself shows its pixels.
  pictures.Take(4, 3, 0.25f);
  shown.Update(pictures, look, {});
  held = HeldOf(shown);
  EXPECT_EQ(held.width, 4);
  EXPECT_EQ(held.height, 3);
  EXPECT_EQ(held.magnified, GL_NEAREST);

  // Another look at the same picture, at once.
  look.exposure = 2;
  shown.Update(pictures, look, {});
  EXPECT_EQ(HeldOf(shown).red, EncodeByte(0.5));
  EXPECT_EQ(shown.saturated(), 0);
  look.exposure = 4;
  shown.Update(pictures, look, {});
  EXPECT_EQ(shown.saturated(), 1);
  look.exposure = 2;
  shown.Update(pictures, look, {});

  // Neither of them anew: nothing is drawn, whatever the frame holds.
  std::ranges::fill(pictures.frame.radiance.data, 0.1f);
  shown.Update(pictures, look, {});
  EXPECT_EQ(HeldOf(shown).red, EncodeByte(0.5));

  // Of false colours the scale is known.
  look.tone = Tone::kFalseColour;
  look.scale = render::FalseColourScale{0.01, 10};
  shown.Update(pictures, look, {});
  EXPECT_EQ(shown.scale().min, 0.01);
  EXPECT_EQ(shown.scale().max, 10);
  EXPECT_FALSE(shown.saturated());
}

}  // namespace
}  // namespace luxfield::view
