// The frequency at which a lamp pulses, from frames that begin at irregular times.
//
// The mean level of a frame of exposure T begun at t, of a lamp of frequency f and any waveform, is
// periodic in t. Of each burst g, all of one exposure,
//
//   x_n = L + S t_n + sum_{k = 1..K} [A_k cos(2 pi k f t_n) + B_k sin(2 pi k f t_n)] + noise,
//
// linear in its own L, S, A and B for a given f: a least-squares periodogram of K harmonics (N. R.
// Lomb, Astrophys. Space Sci. 39, 1976; J. D. Scargle, Astrophys. J. 263, 1982; A.
// Schwarzenberg-Czerny, Astrophys. J. 460, 1996). The exposure's sinc(k f T) is in A and B, and so
// are a constant error of t and of T and a rolling shutter: only f is common to the bursts. Where
// one exposure is of nearly whole periods and sees no pulses another does.
//
// With R_g the residual sum of squares over that of the straight line, n_g frames, and
// nu_g = n_g - 2 - 2 K degrees of freedom, X = -sum_g nu_g / 2 ln R_g of pure noise at one f is
// close to Gamma(K G, 1) for G bursts (exactly for K = 1), and the false-alarm probability is at
// most
//
//   P = N_f exp(-X) sum_{j < K G} X^j / j!
//
// over N_f frequencies. Of all f and K the one of least P counts. There is no number where P
// exceeds kFalseAlarm, nor where an f that is no multiple or part of the best is 1 / kFalseAlarm
// times as likely or more (times that repeat), nor where few frames catch a pulse.
//
// f by Gauss-Newton. With e_n the residuals, d_n their change with f and w_g = nu_g / sum e^2,
//
//   sigma_f^2 = sum_g w_g^2 sum_n d_n^2 (e_n / (1 - h_n))^2 / (sum_g w_g sum_n d_n^2)^2,
//
// h_n a frame's leverage (J. G. MacKinnon, H. White, J. Econometrics 29, 1985: HC3), and not below
// the common 1 / sum_g w_g sum d^2: harmonics beyond K and times that jitter are no even noise.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace luxfield::capture {

struct LevelBurst {             // of one exposure
  std::vector<double> start_s;  // of the exposures, but for a constant
  std::vector<double> level;    // above black, any unit
};

struct LampFrequency {
  double hz = 0;        // 0: cannot be told
  double sigma_hz = 0;  // standard error
  int harmonics = 0;    // K
  double false_alarm = 1;
  std::string why;  // it cannot be told
};

inline constexpr double kLowestPulse_hz = 40, kHighestPulse_hz = 25e3;
inline constexpr double kFalseAlarm = 1e-6;

// Of bursts of more than 20 frames each, in any number.
LampFrequency FrequencyOf(std::span<const LevelBurst> bursts);

// "217.30041 Hz (standard error 0.0003 Hz)": with the digits that it allows.
std::string FormatHertz(double hz, double sigma_hz);

}  // namespace luxfield::capture
