// Writes a light field, reads it back and says how much light it sends out.
#include <luxfield/lightfield/light_field.h>
#include <luxfield/version.h>

#include <cmath>
#include <cstdio>

namespace lf = luxfield::lightfield;

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  // 2 x 2 quadratic B-splines, 10 mm apart, on F; 4 x 3 texels of 2 mm on I, 50 mm in front of it.
  lf::LuminaireGeometry geometry;
  geometry.delta_m = 0.05;
  geometry.grid = lf::BasisGrid::Centred(lf::Basis::Make(lf::BasisKind::kBspline2), 2, 2, 0.01);
  geometry.lattice = {
      .width = 4, .height = 3, .s0_m = -0.004, .t1_m = 0.003, .ds_m = 0.002, .dt_m = 0.002};
  geometry.unit = lf::FluxUnit::kWatt;
  lf::LightField field(geometry);
  for (int m = 0; m < geometry.grid.count(); ++m)
    for (float& coefficient : field.image(m, 0)) coefficient = 100.0f * static_cast<float>(m + 1);
  lf::WriteLightField(argv[1], field);

  const double flux = lf::TotalFlux(lf::ReadLightField(argv[1]))[0];
  std::printf("luxfield %s: %.6g W\n", LUXFIELD_VERSION, flux);
  // 12 texels of (2 mm)^2, coefficients of 100 to 400 W sr^-1 m^-4, each basis function's integral
  // being (10 mm)^2.
  const double expected = 12 * 4e-6 * (100 + 200 + 300 + 400) * 1e-4;
  return std::abs(flux - expected) < 1e-12 * expected ? 0 : 1;
}
