// A stack of pictures -> the response of every channel, and its `*.cal.json`
// (docs/formats/calibration.md).
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/reconstruct/calibrate/response/fit_response.h"
#include "luxfield/reconstruct/calibrate/response/picture_stack.h"

namespace luxfield::reconstruct {

struct CalibrateResponseOptions {
  FitResponseOptions fit;
  int samples = 2000;  // pixels of flat blocks a channel; kPublished: levels of the histograms
};

struct ResponseCalibration {
  int bits = 8;
  ResponseMethod method = ResponseMethod::kDebevecMalik;
  std::vector<double> exposures_s;
  std::vector<FittedResponse> channels;  // R, G, B or grey; noise of a pixel
  std::map<std::string, std::string> provenance;

  std::vector<ResponseCurve> curves() const;
};

// Fits every channel; the noise is then measured on some 20000 single pixels, chosen without
// looking at them. Throws what FitResponse throws, and InputError for histograms of 16-bit pictures
// or where too few pixels are usable in two pictures to tell their noise.
ResponseCalibration CalibrateResponse(const PictureStack& stack,
                                      const CalibrateResponseOptions& options);

std::string ResponseMethodName(ResponseMethod method);
ResponseMethod ResponseMethodFromName(const std::string& name);  // InputError naming the choices

// Equal calibrations give equal bytes; no clock time.
nlohmann::json ToJson(const ResponseCalibration& calibration);
void WriteResponseCalibration(const std::filesystem::path& path,
                              const ResponseCalibration& calibration);

struct StoredResponse {
  int bits = 8;
  std::vector<ResponseCurve> curves;
  std::string sha256;
};

// Throws InputError naming file and field: not a response calibration, of another version, nodes
// that do not rise, sigma or noise not above 0.
StoredResponse ReadResponseCalibration(const std::filesystem::path& path);

}  // namespace luxfield::reconstruct
