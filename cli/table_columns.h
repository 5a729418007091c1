// Which columns of a report's table hold numbers and stand to the right, on pages of HTML and PDF alike.
#pragma once

#include <string>
#include <vector>

namespace luxfield::cli {

// Of a table whose first row is its head: a column in which more than half of the cells that are not
// empty, below the head, are numbers: "2.5", "-3 %", "0.57° D", "> 0.999", "5.80 ± 0.01" or "-"; not
// "75R", a name, nor "2.5° R, 1° U", a place. As many as the longest row has.
std::vector<bool> NumberColumns(const std::vector<std::vector<std::string>>& rows);

}  // namespace luxfield::cli
