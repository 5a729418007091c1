#include "cli/run.h"

int main(int argc, char** argv) { return luxfield::cli::Run(argc, argv); }
