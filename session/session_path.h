// Names of files in a session, and what they may lead to.
//
// A session may come from another machine, or from somebody who means harm: its journal, manifest
// and session.json name files, and its folders are written to and cleaned up on resume. None of
// that may reach outside the session's folder. The folder itself may be reached through links: it
// is what the user names. New sessions are private (folder 0700, files 0600), so that nobody else
// can exchange a file between the check and its use.
#pragma once

#include <filesystem>
#include <string>

namespace luxfield::session {

// Throws InputError, beginning with `where`, for names that are empty, absolute or climb with "..".
void CheckSessionFileName(const std::string& name, const std::string& where);

// `folder / name`, where that is not, and does not lead through, a symbolic link below `folder`;
// throws InputError as above otherwise. The file need not exist.
std::filesystem::path SessionFile(const std::filesystem::path& folder, const std::string& name,
                                  const std::string& where);

}  // namespace luxfield::session
