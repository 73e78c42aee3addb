// What the kernels read of a robot. Joint k comes after its parent.
#pragma once

namespace hovi::dynamics {

// The frame of a joint has the joint's axis as its z axis.
struct TreeJoint {
  int parent;             // -1: the world
  int q;                  // index of its coordinate in a configuration
  bool continuous;        // (cos, sin) is stored instead of the angle
  double rotation[9];     // of this frame in the parent's, at q = 0, by columns
  double translation[3];  // [m]
  double angular;         // angle about z per unit of q: 1, or 0 for a prismatic joint
  double linear;          // displacement along z per unit of q [m]
  double mass;            // of the body [kg]
  double center[3];       // its center of mass in this frame [m]
  double moment[6];       // integral of x x^T dm about the center [kg m^2]: xx xy xz yy yz zz
  double armature;        // [kg m^2] or [kg]
  double subtree_mass;    // of this body and all of its descendants [kg]
};

// The joints [begin, end).
struct Run {
  int begin, end;
};

// Some joints, in ascending order.
struct JointSet {
  const Run* runs;
  int count;
};

// A base that moves on SE(3), SO(3) or SE(2). The components of its velocity, in its own frame, are
// the first joints of the tree, each the parent of the next.
struct TreeBase {
  int size;              // how many; 0: there is no such base
  int twist_indices[6];  // of each in a twist: linear x y z, angular x y z
  int q;                 // index of its quaternion (x, y, z, w) in a configuration
  bool planar;           // (cos, sin) of the angle about z is stored instead
};

struct TreeView {
  int n;
  int nq;  // numbers in a configuration
  const TreeJoint* joints;
  TreeBase base;
  double gravity[6];           // spatial acceleration of free fall: linear, angular. Where a base
                               // moves, in the axes that it has at the neutral configuration.
  const int* common_ancestor;  // (n, n): the last joint that moves both, or -1
  const JointSet* relatives;   // (n,): the ancestors of i, i, and its descendants
  const JointSet* ancestors;   // (n,): the ancestors of i, and i
};

}  // namespace hovi::dynamics
