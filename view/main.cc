// luxfield-view: what `luxfield view` is handed over to (cli/quick.h).
#include "luxfield/cli/run.h"
#include "luxfield/view/verbs/verb_view.h"

int main(int argc, char** argv) {
  return luxfield::cli::RunProgram(argc, argv, luxfield::view::AddView);
}
