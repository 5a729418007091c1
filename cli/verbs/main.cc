// luxfield-verbs: every verb but those of rooms above this one (cli/quick.h).
#include "luxfield/cli/run.h"

int main(int argc, char** argv) { return luxfield::cli::Run(argc, argv); }
