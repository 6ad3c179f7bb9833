"""Opens each kind of argument block inside kernels."""

from phy.kernels.argument_block import opener
from phy.tables.acquisition import Room, Training
from phy.tables.burst import Axes, Channel, Scratch, Tones
from phy.tables.code import Form, Workspace
from phy.tables.detector import SearchMemory
from phy.tables.mapping import Map
from phy.tables.notch import NotchMemory

open_tones = opener(Tones)
open_axes = opener(Axes)
open_channel = opener(Channel)
open_scratch = opener(Scratch)
open_training = opener(Training)
open_room = opener(Room)
open_form = opener(Form)
open_workspace = opener(Workspace)
open_map = opener(Map)
open_search = opener(SearchMemory)
open_notch = opener(NotchMemory)
