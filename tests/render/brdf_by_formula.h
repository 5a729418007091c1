// The BRDFs of kernels/brdf/brdf.clh in double, written out from their sources: glTF 2.0, appendix
// B.3, KHR_materials_pbrSpecularGlossiness, and Lafortune and Willems 1994.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "luxfield/lightfield/geometry.h"
#include "luxfield/render/device/device.h"
#include "luxfield/render/kernels/brdf/brdf_types.clh"

namespace luxfield::render {

// As a G-buffer holds it.
struct TestBrdf {
  int kind = kLambert;
  std::array<double, 3> albedo{0.5, 0.5, 0.5};
  std::array<double, 4> gloss{};

  static TestBrdf Phong(std::array<double, 3> albedo, std::array<double, 3> specular,
                        double exponent) {
    return {kPhong, albedo, {specular[0], specular[1], specular[2], exponent}};
  }
  static TestBrdf Ggx(std::array<double, 3> base, double metallic, double roughness) {
    return {kGgx, base, {metallic, roughness, 0, 0}};
  }
  // Diffuse reflectance, reflectance at normal incidence.
  static TestBrdf Specular(std::array<double, 3> diffuse, std::array<double, 3> f0,
                           double roughness) {
    return {kSpecularGlossiness, diffuse, {f0[0], f0[1], f0[2], roughness}};
  }
  bool is_ggx() const { return kind == kGgx || kind == kSpecularGlossiness; }
  double roughness() const { return gloss[kind == kGgx ? 1 : 3]; }
  cl_float4 AlbedoTexel() const {
    return {{static_cast<float>(albedo[0]), static_cast<float>(albedo[1]),
             static_cast<float>(albedo[2]), static_cast<float>(kind)}};
  }
  cl_float4 GlossTexel() const {
    return {{static_cast<float>(gloss[0]), static_cast<float>(gloss[1]),
             static_cast<float>(gloss[2]), static_cast<float>(gloss[3])}};
  }
};

// f_r, sr^-1; n.eye > 0, and 0 for light from below. Directions need not have unit length: those of
// the device are rounded to float32, and a power of 1e6 would see it.
inline std::array<double, 3> BrdfByFormula(const TestBrdf& brdf, lightfield::Vec3 n,
                                           lightfield::Vec3 eye, lightfield::Vec3 light) {
  using std::numbers::pi;
  n = Normalized(n);
  eye = Normalized(eye);
  light = Normalized(light);
  const double nl = Dot(n, light), nv = Dot(n, eye);
  std::array<double, 3> f{};
  if (nl <= 0) return f;
  if (brdf.kind == kLambert || brdf.kind == kPhong)
    for (int c = 0; c < 3; ++c) f[c] = brdf.albedo[c] / pi;
  if (brdf.kind == kPhong) {
    const double e = brdf.gloss[3], cosine = Dot(2 * nv * n - eye, light);
    if (cosine > 0)
      for (int c = 0; c < 3; ++c) f[c] += brdf.gloss[c] * (e + 2) / (2 * pi) * std::pow(cosine, e);
  }
  if (brdf.is_ggx()) {
    const double alpha = std::max(brdf.roughness() * brdf.roughness(), 1e-3), a2 = alpha * alpha;
    const lightfield::Vec3 h = Normalized(light + eye);
    // (n.h)^2 (alpha^2 - 1) + 1 without cancellation.
    const double nh = Dot(n, h), sine = Length(Cross(n, h)), t = a2 * nh * nh + sine * sine;
    const double d = a2 / (pi * t * t);
    const double v =
        1 / ((nl + std::sqrt(a2 + (1 - a2) * nl * nl)) * (nv + std::sqrt(a2 + (1 - a2) * nv * nv)));
    const double schlick = std::pow(1 - std::clamp(std::abs(Dot(eye, h)), 0.0, 1.0), 5);
    for (int c = 0; c < 3; ++c) {
      // The appendix' final form: F0 and the diffuse colour are mixed, not the two BRDFs.
      const bool metallic_roughness = brdf.kind == kGgx;
      const double metallic = brdf.gloss[0];
      const double f0 =
          metallic_roughness ? 0.04 + (brdf.albedo[c] - 0.04) * metallic : brdf.gloss[c];
      const double diffuse = (metallic_roughness ? 1 - metallic : 1) * brdf.albedo[c];
      const double fresnel = f0 + (1 - f0) * schlick;
      f[c] = (1 - fresnel) * diffuse / pi + fresnel * v * d;
    }
  }
  return f;
}

}  // namespace luxfield::render
