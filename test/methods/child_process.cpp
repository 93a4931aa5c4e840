// Programs that others answer with live no longer than what asks them.

#include "methods/child_process.h"

#include <sys/wait.h>

#include <catch2/catch.hpp>
#include <cerrno>
#include <string>

using namespace cb;

TEST_CASE("a program is waited for when nobody asks it any more, whether it heeds the end of its input or not",
          "[external]") {
  for (const char* command : {"exec cat", "exit 3", "trap '' TERM; echo on; while :; do sleep 1; done"})
    for (const bool talk : {true, false}) {
      INFO(command << (talk ? ", asked" : ", let alone"));
      {
        ChildProcess program(command, talk);
        std::string line;
        if (talk && std::string(command).find("echo") != std::string::npos) CHECK(program.read_line(line));
      }
      errno = 0;
      CHECK(waitpid(-1, nullptr, WNOHANG) == -1);
      CHECK(errno == ECHILD);
    }
}
