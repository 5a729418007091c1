// *.tab.exr: round trip, equal bytes, and files that lie.
#include "luxfield/preprocess/table_io.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"

namespace luxfield::preprocess {
namespace {

std::filesystem::path TempFile(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) /
         ("luxfield_tables_" + std::to_string(getpid()) + "_" + name);
}

Tables Sample() {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid.basis.cells = 3;
  g.grid.width = 3;
  g.grid.height = 2;
  g.grid.spacing_m = 0.01;
  g.lattice = {9, 7, -0.1, 0.1, 0.02, 0.03};
  lightfield::LightField field(g);
  core::Random random(7, 0);
  for (float& c : field.data) c = random.UniformFloat();
  return BuildTables(field, "x.lf.exr", core::Sha256("x"));
}

TEST(TableIo, RoundTripIsExactAndBytesRepeat) {
  const Tables tables = Sample();
  const auto a = TempFile("a.tab.exr"), b = TempFile("b.tab.exr");
  WriteTables(a, tables);
  WriteTables(b, tables);
  EXPECT_EQ(core::ReadFile(a), core::ReadFile(b));
  const Tables read = ReadTables(a);
  EXPECT_EQ(read.sat, tables.sat);
  EXPECT_EQ(read.exponent, tables.exponent);
  EXPECT_EQ(read.reference, tables.reference);
  EXPECT_EQ(read.light_field_sha256, tables.light_field_sha256);
  EXPECT_EQ(read.width, 9);
  EXPECT_EQ(read.height, 7);
  EXPECT_EQ(read.count(), 6);
  EXPECT_EQ(read.basis_cells, 3);
}

void ExpectRefused(const std::filesystem::path& path, const std::string& fragment) {
  try {
    ReadTables(path);
    FAIL() << "accepted although: " << fragment;
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find(fragment), std::string::npos) << error.what();
  }
}

TEST(TableIo, RefusesBrokenFiles) {
  const auto good = TempFile("good.tab.exr"), bad = TempFile("bad.tab.exr");
  WriteTables(good, Sample());
  const std::string bytes = core::ReadFile(good);
  ExpectRefused(TempFile("absent.tab.exr"), "");
  core::WriteFileAtomically(bad, "");
  ExpectRefused(bad, "");
  core::WriteFileAtomically(bad, "not an EXR file at all, but long enough to be read as one");
  ExpectRefused(bad, "");
  for (const double part : {0.02, 0.1, 0.5, 0.9, 0.999}) {
    core::WriteFileAtomically(
        bad, std::string_view(bytes).substr(
                 0, static_cast<std::size_t>(part * static_cast<double>(bytes.size()))));
    ExpectRefused(bad, "");
  }
  core::WriteExrImage(bad, core::Image(4, 4, 1));
  ExpectRefused(bad, "luxfield:kind");
}

// A table file with one thing changed.
TEST(TableIo, RefusesFilesThatLie) {
  const Tables tables = Sample();
  const auto bad = TempFile("lie.tab.exr");
  const auto expect = [&](const std::string& fragment, const std::function<void(Tables&)>& change) {
    Tables changed = tables;
    change(changed);
    WriteTables(bad, changed);
    ExpectRefused(bad, fragment);
  };
  const std::size_t last = tables.sat_size() - 1;
  expect("S.00.00", [&](Tables& t) { t.sat[last] = 0; });                          // decreasing
  expect("S.00.00", [&](Tables& t) { t.sat[3] = 1; });                             // border
  expect("S.00.01", [&](Tables& t) { t.sat[tables.sat_size() + last] = ~0ull; });  // too large
  expect("S.01.02", [&](Tables& t) { t.sat[5 * tables.sat_size() + 10] = 1; });    // left border
  expect("luxfield:exponent", [](Tables& t) { t.exponent[2] = 5000; });
  expect("luxfield:light_field_sha256", [](Tables& t) { t.light_field_sha256 = "abc"; });
  expect("reference", [](Tables& t) { t.reference[4].images = 10; });
  expect("reference",
         [](Tables& t) { t.reference[4].s_m = std::numeric_limits<float>::infinity(); });
}

TEST(TableIo, RefusesWrongHeaders) {
  const auto bad = TempFile("header.tab.exr");
  const std::vector<float> zero(16, 0.0f);
  const auto write = [&](int version, int grid_width) {
    const core::ExrPartView part{
        "S.00.00",
        4,
        4,
        {{"lo", std::span<const float>(zero)}, {"hi", std::span<const float>(zero)}},
        {{"luxfield:kind", std::string("tables")},
         {"luxfield:version", version},
         {"luxfield:grid_width", grid_width},
         {"luxfield:grid_height", 1},
         {"luxfield:basis_cells", 3},
         {"luxfield:exponent", 0},
         {"luxfield:light_field_sha256", std::string(64, '0')}}};
    const core::ExrPartView reference{
        "reference", 3, 3, {{"s", std::span<const float>(zero).first(9)}}, {}};
    const core::ExrPartView parts[] = {part, reference};
    core::WriteExr(bad, parts);
  };
  write(2, 1);
  ExpectRefused(bad, "luxfield:version");
  write(1, 100000);
  ExpectRefused(bad, "luxfield:grid_width");
  write(1, 2);
  ExpectRefused(bad, "parts");
  write(1, 1);
  ExpectRefused(bad, "lo");  // FLOAT where UINT is expected
}

}  // namespace
}  // namespace luxfield::preprocess
