// Numbers as reports print them: with no more digits than their uncertainties leave a meaning (JCGM
// 100:2008, 7.2.6).
#pragma once

#include <optional>
#include <string>

namespace luxfield::cli {

// Of a value without an uncertainty, trailing zeros left out: "147240", "0.0062117", "1.2e-07". Powers of
// ten below 1e-4 and from 1e9 on.
std::string Digits(double value, int digits = 5);

// The value down to the decimal place of the second digit of its uncertainty: "2.49" of 2.4863 +- 0.13,
// "147200" of 147240 +- 620, "0", never "-0", of what is less than half of that place. Digits where
// there is no uncertainty, or none above 0.
std::string RoundedTo(double value, const std::optional<double>& u);

// "0.13", "620": two digits, as Digits prints them but for the zero of "0.10"; "0" of 0.
std::string UncertaintyText(double u);

}  // namespace luxfield::cli
