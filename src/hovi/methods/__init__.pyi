"""The public names of hovi.methods: read by type checkers, and by `lazy_loader`."""

from .method import Bounds as Bounds
from .method import Criteria as Criteria
from .method import Ended as Ended
from .method import Iteration as Iteration
from .method import Method as Method
from .method import Outputs as Outputs
from .method import Program as Program
from .method import QuadraticProgram as QuadraticProgram
from .method import Reason as Reason
from .method import Start as Start
from .sequential_quadratic import SequentialQuadratic as SequentialQuadratic
