// How much light a cloudless atmosphere lets through and scatters down: Bird and Riordan, "Simple
// solar spectral model for direct and diffuse irradiance on horizontal and tilted planes at the
// earth's surface for cloudless atmospheres", J. Climate Appl. Meteor. 25 (1986) 87 (also SERI
// TR-215-2436), at its 34 wavelengths between 380 and 780 nm, seen by the CIE 1931 observer.
//
//   direct normal       E_n = H0 / R^2 T_r T_a T_w T_o T_u        (Rayleigh, aerosol, water vapour,
//   diffuse horizontal  E_d = E_Rayleigh + E_aerosol + E_ground   ozone, mixed gases)
//
// at sea level with 0.35 atm-cm of ozone and 2 cm of precipitable water, the air mass of Kasten and
// Young (1989), a rural aerosol of single scattering albedo 0.945 at 400 nm and asymmetry 0.65.
// Turbidity T is Preetham's (1999): the aerosol's optical thickness at wavelength l, in
// micrometres, is beta l^-1.3 with beta = 0.04608 T - 0.04586. The observer is the fit of Wyman,
// Sloan and Shirley (JCGT 2, 2013), 0.1 % in luminance.
#pragma once

#include "core/colour.h"
#include "lightfield/sun_position.h"

namespace luxfield::lightfield {

// Turbidities that the fits were made for: 2 is very clear, 3 clear, 6 hazy.
inline constexpr double kLeastTurbidity = 1.8, kLargestTurbidity = 10;

// Illuminance, lx: linear Rec. 709 whose luminance is photometric. Within Rec. 709 (IntoGamut).
struct ClearSky {
  core::Rgb direct_normal{};
  core::Rgb diffuse_horizontal{};
};

// `ground_albedo` brightens the sky a little from below. Throws InputError for a turbidity or an
// albedo (0 to 1) out of range, or a sun whose centre is below the horizon: the model knows no
// twilight. Below about 5 degrees its diffuse light is too dark: it vanishes with the sun's sine.
ClearSky FindClearSky(const SunPosition& sun, double turbidity, double ground_albedo);

// Illuminance of the sun outside of the atmosphere at 1 au, lx, by the same spectrum.
core::Rgb ExtraterrestrialIlluminance();

}  // namespace luxfield::lightfield
