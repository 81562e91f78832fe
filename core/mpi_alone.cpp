// One rank, where there is no MPI: the solver core on a bare machine. The other ranks of mpi.cpp are not
// there, so nothing is ever sent.

#include "core/mpi.hpp"

namespace hemowalk::mpi {

int start() { return 0; }
void finish() {}
int world_rank() { return 0; }

struct Ranks::Impl {};

Ranks::Ranks() = default;
Ranks Ranks::world() { return {}; }
Ranks Ranks::first(int) const { return {}; }
int Ranks::rank() const { return 0; }
int Ranks::count() const { return 1; }
void Ranks::sum(View<double>) const {}
void Ranks::max(View<double>) const {}
std::vector<std::vector<std::byte>> Ranks::gather(std::vector<std::byte> mine) const {
  return {std::move(mine)};
}
std::vector<std::byte> Ranks::scatter(const std::vector<std::vector<std::byte>>& parts) const {
  return parts.at(0);
}
void Ranks::broadcast(std::vector<std::byte>&) const {}
void Ranks::on_root(const std::function<void()>& action) const { action(); }
void Ranks::guarded(const std::function<void()>& action) const { action(); }

struct Messages::Pending {};
Messages::Messages(Ranks ranks) : ranks_(std::move(ranks)) {}
Messages::~Messages() = default;
Messages::Messages(Messages&&) noexcept = default;
void Messages::send(int, int, View<const std::byte>) { contract(false, "a message to another rank"); }
void Messages::receive(int, int, View<std::byte>) { contract(false, "a message from another rank"); }
void Messages::receive(int, int, std::vector<std::byte>&) { contract(false, "a message from another rank"); }
void Messages::wait() {}

struct Agreement::State {};
Agreement::Agreement(Ranks ranks) : ranks_(std::move(ranks)) {}
Agreement::~Agreement() = default;
unsigned Agreement::any(unsigned mine) { return mine; }

}  // namespace hemowalk::mpi
