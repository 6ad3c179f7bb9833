"""Loads the PHY's compiled code."""

import asyncio

import phy


async def load_phy() -> None:
    """Compile the PHY, or load its compiled code, off the event loop."""
    await asyncio.to_thread(phy.warm_up)
