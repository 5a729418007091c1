// How much sunlight a cloudless atmosphere lets through: the direct part of Bird and Riordan,
// "Simple solar spectral model for direct and diffuse irradiance on horizontal and tilted planes at
// the earth's surface for cloudless atmospheres", J. Climate Appl. Meteor. 25 (1986) 87 (also SERI
// TR-215-2436), at its 34 wavelengths between 380 and 780 nm, seen by the CIE 1931 observer:
//
//   E_n = H0 / R^2 T_r T_a T_w T_o T_u       (Rayleigh, aerosol, water vapour, ozone, mixed gases)
//
// at sea level with 0.35 atm-cm of ozone and 2 cm of precipitable water, and the air mass of Kasten
// and Young (1989). Turbidity T is Preetham's (1999): the aerosol's optical thickness at wavelength
// l, in micrometres, is beta l^-1.3 with beta = 0.04608 T - 0.04586. The observer is the fit of
// Wyman, Sloan and Shirley (JCGT 2, 2013), 0.1 % in luminance.
#pragma once

#include "luxfield/core/colour.h"
#include "luxfield/environment/sun_position.h"

namespace luxfield::environment {

// Illuminance on a plane that faces the sun, lx: linear Rec. 709 whose luminance is photometric,
// within Rec. 709 (IntoGamut). The apparent sun is not below the horizon, turbidity not below 1.
core::Rgb DirectNormalIlluminance(const SunPosition& sun, double turbidity);

// The same outside of the atmosphere at 1 au, by the same spectrum.
core::Rgb ExtraterrestrialIlluminance();

// Optical thickness of the whole atmosphere's air (Rayleigh, by the model) and aerosol, at
// `um` micrometres.
double RayleighThickness(double um);
double AerosolThickness(double turbidity, double um);

}  // namespace luxfield::environment
