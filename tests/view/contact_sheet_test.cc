// Coefficient images side by side, and the levels of a frame.
#include "luxfield/view/picture/contact_sheet.h"

#include <gtest/gtest.h>

#include <numeric>

#include "luxfield/view/session/frame_levels.h"
#include "tests/render/small_scene.h"

namespace luxfield::view {
namespace {

TEST(ContactSheetTest, EachValueIsTheMeanOfItsTexels) {
  lightfield::LightField field = render::SoftLamp();  // 4 x 3 images of 32 x 32 texels
  std::iota(field.data.begin(), field.data.end(), 0.0f);
  for (const int most_side : {2048, 60}) {
    const ContactSheet sheet = ContactSheetOf(field, most_side);
    EXPECT_EQ(sheet.shrink, most_side == 60 ? 3 : 1);
    EXPECT_EQ(sheet.cell_width, most_side == 60 ? 11 : 32);
    EXPECT_EQ(sheet.values.width, 4 * sheet.cell_width);
    EXPECT_EQ(sheet.values.height, 3 * sheet.cell_height);
    // On the left of the top row: image (0, 2), from its first texel.
    const auto first = static_cast<double>(field.image(field.geometry.grid.index(0, 2), 0)[0]);
    double mean = 0;
    for (int row = 0; row < sheet.shrink; ++row)
      for (int column = 0; column < sheet.shrink; ++column)
        mean += (first + 32 * row + column) / (sheet.shrink * sheet.shrink);
    EXPECT_FLOAT_EQ(sheet.values.at(0, 0, 0), static_cast<float>(mean));
    // The last value is of the last texels alone that are left.
    const SheetPlace last = PlaceOn(sheet, field, sheet.values.width - 1, sheet.values.height - 1);
    EXPECT_EQ(last.i, 3);
    EXPECT_EQ(last.j, 0);
    EXPECT_EQ(last.column, sheet.shrink * (sheet.cell_width - 1));
    EXPECT_EQ(last.row, last.column);
    EXPECT_NEAR(sheet.values.at(0, sheet.values.height - 1, sheet.values.width - 1),
                LuminanceOf(field, {3, 0, 31, 31}), 32 * 2);
  }
}

TEST(FrameLevelsTest, CountEveryPixelOnTheCamerasScale) {
  session::RawFrame frame;
  frame.width = 40;
  frame.height = 30;
  frame.dn.assign(frame.size(), 0);
  frame.dn[0] = 3000;  // of 12 bits
  frame.dn[1] = 4095;
  const FrameLevels levels = LevelsOf(frame, "f.tif", 16, 20);
  EXPECT_EQ(levels.top, 4095);
  EXPECT_EQ(levels.counts[0], 1198);
  EXPECT_EQ(levels.counts[11], 1);  // 3000 / 256
  EXPECT_EQ(levels.counts[15], 1);
  EXPECT_EQ(levels.small.width, 20);
  EXPECT_EQ(levels.small.height, 15);
  EXPECT_FLOAT_EQ(levels.small.at(0, 0, 0), 7095.0f / 4 / 4095);
  frame.dn.assign(frame.size(), 0);
  EXPECT_EQ(LevelsOf(frame, "f.tif").top, 255);
}

}  // namespace
}  // namespace luxfield::view
