// What could not be opened, as the sentence that says why.
#pragma once

#include <memory>

#include "luxfield/view/documents/document.h"

namespace luxfield::view {

std::unique_ptr<Document> FailedDocument(const Failure& failure);

// The sentence, wrapped, in the middle of the ImGui window that is begun.
void DrawSentence(const std::string& title, const std::string& sentence);

}  // namespace luxfield::view
