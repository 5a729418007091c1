// How well a camera stands for the eye (ISO/CIE 19476:2014, 5.2): with the relative responsivity s of
// what became luminance, V of the eye (CIE 018:2019) and the spectra S of light,
//
//   F  = integral S_lamp V / integral S_lamp s  .  integral S_cal s / integral S_cal V
//   f1' = integral |s* - V| / integral V,   s* = s integral S_A V / integral S_A s
//
// F is what a reading of the lamp is to be multiplied by after a calibration with light of spectrum
// S_cal; f1' is the general index, S_A that of illuminant A. Curves are linear between their points
// and 0 beyond their ends; integrals of their products are exact.
//
//   const Spectrum lamp = ReadSpectrum("lamp.csv"), camera = ReadSpectrum("camera.csv");
//   const double f = SpectralMismatchFactor(camera, lamp, IlluminantA());
#pragma once

#include <filesystem>
#include <vector>

namespace luxfield::photometry {

// Relative, over wavelengths that rise.
struct Spectrum {
  std::vector<double> nm, value;
};

// Lines of two numbers, wavelength in nm and value, apart by commas, semicolons, tabs or blanks; empty
// lines and those that begin with # are passed over, and a first line of words. Throws InputError
// naming file and line.
Spectrum ReadSpectrum(const std::filesystem::path& file);

const Spectrum& LuminousEfficiency();  // V(lambda), each 5 nm from 380 to 780
// 2848 K with c_2 = 0.01435 m K (ISO/CIE 11664-2:2022), each nm from 300 to 1100.
const Spectrum& IlluminantA();

// integral of the product.
double IntegralOf(const Spectrum& a, const Spectrum& b);

// Throws std::invalid_argument where one of the integrals is not above 0: nothing is seen.
double SpectralMismatchFactor(const Spectrum& responsivity, const Spectrum& lamp,
                              const Spectrum& calibration);
double SpectralMismatchIndex(const Spectrum& responsivity);

}  // namespace luxfield::photometry
