// What a session's files say of how a lamp was measured, for its certificate.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "luxfield/cli/reports/certificate.h"
#include "luxfield/session/session_store.h"

namespace luxfield::cli {

std::vector<std::pair<std::string, std::string>> SetUpOf(const session::SessionReader& session);

// plan.json, session.json, the journal and, of a sealed session, its manifest.
std::vector<HashedFile> FilesOf(const session::SessionReader& session);

}  // namespace luxfield::cli
