// What pictures that a bridge writes beside another file say of it.
#pragma once

namespace luxfield::bridges {

// An attribute: the name of the file that they belong to.
inline constexpr char kBelongsTo[] = "luxfield:belongs_to";

}  // namespace luxfield::bridges
