#pragma once
/// \file The processes (ranks) that share one run, and what they say to each other. A program that was not
/// started by mpirun or srun is one rank and never touches MPI. All messages are non-blocking underneath, and
/// every wait listens for the errors of other ranks: an error on one rank ends all of them.

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "core/check.hpp"
#include "core/view.hpp"

namespace hemowalk::mpi {

/// Joins the other processes if a launcher started this one. Idempotent. \returns the rank in the world.
int start();
/// Leaves them; to be called last, after everything was written and said.
void finish();
/// Rank in the world, 0 before start(): the one that speaks to the user.
int world_rank();

/// A group of ranks. Copies are handles of the same group. Calls marked (all) must be made by all its ranks,
/// in the same order.
class Ranks {
 public:
  /// This process alone.
  Ranks();
  /// All processes of the run.
  static Ranks world();
  /// The first \p count ranks as a group of their own (all); the others become single.
  Ranks first(int count) const;

  int rank() const;
  int count() const;
  bool root() const { return rank() == 0; }

  /// Adds up in rank order, so that sums are the same in every run; all ranks get them (all).
  void sum(View<double> values) const;
  /// Largest values over the ranks (all).
  void max(View<double> values) const;
  /// Bytes of all ranks on the root, in rank order; nothing elsewhere (all).
  std::vector<std::vector<std::byte>> gather(std::vector<std::byte> mine) const;
  /// The root's parts, one per rank: each gets its own (all).
  std::vector<std::byte> scatter(const std::vector<std::vector<std::byte>>& parts) const;
  /// Bytes of the root on all ranks (all).
  void broadcast(std::vector<std::byte>& bytes) const;
  /// Does something on the root only; if it fails there, all ranks throw its error (all).
  void on_root(const std::function<void()>& action) const;

  /// Runs \p action; an error in it is told to all other ranks, whose waits throw it too. \throws what the
  /// action throws, or the error that another rank told first.
  void guarded(const std::function<void()>& action) const;

 private:
  friend class Messages;
  friend class Agreement;
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// Messages under way together.
class Messages {
 public:
  explicit Messages(Ranks ranks);
  ~Messages();
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;
  Messages(Messages&&) noexcept;

  /// \p data must stay as it is until wait().
  void send(int to, int tag, View<const std::byte> data);
  /// A message of known length.
  void receive(int from, int tag, View<std::byte> data);
  /// A message of any length: waits for it. \p data grows, and never shrinks its memory.
  void receive(int from, int tag, std::vector<std::byte>& data);
  /// Until all of them have arrived or left.
  void wait();

 private:
  struct Pending;
  Ranks ranks_;
  std::unique_ptr<Pending> pending_;
};

/// Flags raised by any rank reach all ranks at the same call: what a run does about signals and clocks.
class Agreement {
 public:
  explicit Agreement(Ranks ranks);
  ~Agreement();
  Agreement(const Agreement&) = delete;
  Agreement& operator=(const Agreement&) = delete;
  /// Says \p mine; \returns what any rank said in the call before (one rank: in this call), so that nobody
  /// waits (all).
  unsigned any(unsigned mine);

 private:
  struct State;
  Ranks ranks_;
  std::unique_ptr<State> state_;
};

}  // namespace hemowalk::mpi
