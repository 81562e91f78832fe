#include "support/launch_kernels.hpp"

namespace hemowalk::test {

namespace {

struct AddOne {
  int* at;
  HEMO_HD void operator()(std::size_t i) const { ++at[i]; }
};

struct ReversePieces {
  static constexpr int threads = 128;
  int* at;
  HEMO_HD int phases() const { return 2; }
  HEMO_HD void operator()(int phase, BlockThread who, unsigned char* shared) const {
    int* held = reinterpret_cast<int*>(shared);
    int* piece = at + static_cast<std::size_t>(who.block) * reversed_length;
    for (int i = static_cast<int>(who.thread); i < reversed_length; i += threads)
      phase == 0 ? held[i] = piece[i] : piece[i] = held[reversed_length - 1 - i];
  }
};

}  // namespace

void add_one(Queue& queue, int* at, std::size_t n) { queue.for_each(n, AddOne{at}); }

void reverse_pieces(Queue& queue, int* at, std::size_t blocks) {
  queue.blocks(blocks, reversed_length * sizeof(int), ReversePieces{at});
}

}  // namespace hemowalk::test
