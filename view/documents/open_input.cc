#include "luxfield/view/documents/open_input.h"

#include <filesystem>

#include "luxfield/cli/named_files.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file_kind.h"
#include "luxfield/view/documents/failed_document.h"
#include "luxfield/view/documents/picture_document.h"
#include "luxfield/view/documents/session_document.h"

namespace luxfield::view {
namespace {

using core::FileKind;

constexpr char kRemedy[] = "name a scene.toml, an .lf.exr, an .exr picture or a session's folder";

std::unique_ptr<Document> Open(const SceneOptions& options, bool wait) {
  if (wait && !std::filesystem::exists(options.file / "plan.json") &&
      (!std::filesystem::exists(options.file) || std::filesystem::is_directory(options.file)))
    return OpenSession(options.file, wait);
  switch (KindOfInput(options.file)) {
    case InputKind::kScene:
      return OpenScene(options, SceneKind::kScene);
    case InputKind::kLightField:
      return OpenScene(options, SceneKind::kStage);
    case InputKind::kPicture:
      return OpenPicture(options.file);
    case InputKind::kSession:
      break;
  }
  return OpenSession(options.file, wait);
}

}  // namespace

InputKind KindOfInput(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) throw InputError(file.string(), "is not there", kRemedy);
  const FileKind kind = core::WhatIs(file);
  if (core::IsSession(kind)) return InputKind::kSession;
  cli::RequireKind(file, {FileKind::kScene, FileKind::kLightField, FileKind::kExrPicture});
  if (kind == FileKind::kLightField || file.string().ends_with(".lf.exr"))
    return InputKind::kLightField;
  if (kind == FileKind::kScene || file.extension() == ".toml") return InputKind::kScene;
  if (kind == FileKind::kExrPicture || file.extension() == ".exr") return InputKind::kPicture;
  throw InputError(file.string(), "is nothing that can be looked at", kRemedy);
}

SceneKind KindToLight(const std::filesystem::path& file) {
  switch (KindOfInput(file)) {
    case InputKind::kScene:
      return SceneKind::kScene;
    case InputKind::kLightField:
      return SceneKind::kStage;
    case InputKind::kPicture:
    case InputKind::kSession:
      break;
  }
  throw InputError(file.string(), "has nothing that moves", "name a scene.toml or an .lf.exr");
}

std::unique_ptr<Document> OpenInput(const SceneOptions& options, bool wait) {
  try {
    return Open(options, wait);
  } catch (const std::exception&) {
    return FailedDocument(CurrentFailure());
  }
}

}  // namespace luxfield::view
