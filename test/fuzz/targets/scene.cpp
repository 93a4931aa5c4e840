#include <cstddef>
#include <cstdint>

#include "fuzz/inputs.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cb::test::read_as_scene({reinterpret_cast<const char*>(data), size});
  return 0;
}
