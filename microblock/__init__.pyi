from .contact import Contact as Contact
from .data.export import to_csv as to_csv
from .data.export import to_vtk as to_vtk
from .data.sweeps import sweep as sweep
from .errors import BadArgument as BadArgument
from .errors import MicroblockError as MicroblockError
from .errors import MissingExtra as MissingExtra
from .errors import NotConverged as NotConverged
from .fem.body import Body as Body
from .halfplane.kernels import HalfPlane as HalfPlane
from .model.bodies import Block as Block
from .model.events import Event as Event
from .model.events import LoadPath as LoadPath
from .model.law import Microblock as Microblock
from .model.law import Microclamped as Microclamped
from .model.law import Unilateral as Unilateral
from .model.material import Cosserat as Cosserat
from .model.methods import Cells as Cells
from .model.methods import Condensed as Condensed
from .model.methods import Fitted as Fitted
from .model.methods import Newton as Newton
from .model.methods import Panels as Panels
from .model.methods import Uniform as Uniform
from .model.obstacles import Cylinder as Cylinder
from .model.obstacles import Obstacle as Obstacle
from .model.obstacles import Plane as Plane
from .model.obstacles import Punch as Punch
from .model.obstacles import Rough as Rough
from .model.obstacles import Wave as Wave
from .model.obstacles import Wedge as Wedge
from .model.state import State as State
from .view.widgets import explore as explore

__version__: str
__all__: list[str]
